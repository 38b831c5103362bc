#pragma once
// Where the robot file lies that a cell file names.

#include <filesystem>
#include <string>
#include <vector>

#include "calib/model/error.h"

namespace cellcal::calib {

/// There is no robot file of this name. The message is nowhere() and the places, one a line.
struct UnknownRobot : FileError {
  UnknownRobot(std::string asked_for, std::vector<std::filesystem::path> places);
  /// "no robot file "kr5"", without the places.
  std::string nowhere() const;

  std::string name;  ///< that was asked for
  std::vector<std::filesystem::path> looked_for;
};

/// `name` relative to `folder` (an absolute path stays absolute), or the name of a shipped robot.
/// Throws UnknownRobot.
std::filesystem::path find_robot_file(const std::string& name, const std::filesystem::path& folder);

}  // namespace cellcal::calib
