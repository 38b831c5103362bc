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
  std::vector<std::filesystem::path> searched;
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

// Obstacles of a cell file: [[obstacle]], and the stands of targets.

std::vector<Obstacle> read_obstacles(const TomlTable& document, const Robot& robot);
/// `on`: number of the positioner's axes that carry it; 0 without the key. Refuses an axis that the
/// robot lacks.
int read_carrier(const TomlTable& table, const Robot& robot);
/// Empty for the floor.
std::string carrier_to_toml(int carried_by, const Robot& robot);
std::string obstacles_to_toml(const std::vector<Obstacle>& obstacles, const Robot& robot);

/// The keys stand, stand_diameter_mm and stand_height_mm of a target.
void read_stand(const TomlTable& table, Target& target);
std::string stand_to_toml(const Target& target);

// Triangle meshes from CAD: STL, ASCII and binary, in millimetres.

/// Maximum number of triangles: the furniture of a cell needs hundreds.
inline constexpr std::size_t kMostTriangles = 400'000;

/// Triangles of all solids; normals are ignored, triangles without an area are omitted, and so is what follows the
/// last one of a binary file. Throws FileError naming the line (ASCII) or the byte (binary), or the format that the
/// file has instead. `name` denotes the file.
Mesh parse_stl(std::string_view bytes, const std::string& name);
Mesh load_stl(const std::filesystem::path& path);

}  // namespace cellcal::calib
