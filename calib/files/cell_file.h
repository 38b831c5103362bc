#pragma once
// Identification in a cell file: serial numbers, certificates, names. A certificate prints it from the file's
// text; no computation uses it, so it is not part of a Cell.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "calib/files/toml.h"
#include "calib/model/error.h"
#include "calib/model/robot.h"

namespace cellcal::calib {

/// [identity]: `site`, `operator`, `robot_serial`, `controller_serial`, `sensor`, `sensor_serial`. Throws FileError.
void check_identity(const TomlTable& document);
/// `serial` of a [[target]]; `certificate` (number and issuer) and `certificate_date` ("2026-04-01") of a
/// [[target]] or [[length]]. Throws FileError.
void check_certificate(const TomlTable& artefact);
void check_artefact(const TomlTable& target);

// Location of the robot file that a cell file names.

/// No robot file of this name was found. The message is nowhere() and the places searched, one per
/// line.
struct UnknownRobot : FileError {
  UnknownRobot(std::string asked_for, std::vector<std::filesystem::path> places);
  /// "no robot file "kr5"", without the places searched.
  std::string nowhere() const;

  std::string name;  ///< the name requested
  std::vector<std::filesystem::path> looked_for;
};

/// `name` relative to `folder` (an absolute path stays absolute), or the name of a shipped robot.
/// Throws UnknownRobot.
std::filesystem::path find_robot_file(const std::string& name, const std::filesystem::path& folder);

// Robot and cell as TOML documents, both ways. A calibration holds the same documents as JSON.

Robot read_robot(const TomlTable& document);
Cell read_cell(const TomlTable& document, Robot robot);

std::string robot_to_toml(const Robot& robot);
/// `robot_reference` is written to the key `robot`.
std::string cell_to_toml(const Cell& cell, const std::string& robot_reference);

}  // namespace cellcal::calib
