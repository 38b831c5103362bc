#pragma once
// Where the robot file lies that a cell file names.

#include <filesystem>
#include <string>

namespace cellcal::calib {

/// `name` relative to `folder` (an absolute path stays absolute), or the name of a shipped robot.
/// Throws FileError naming all the places that were looked at.
std::filesystem::path find_robot_file(const std::string& name, const std::filesystem::path& folder);

}  // namespace cellcal::calib
