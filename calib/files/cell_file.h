#pragma once
// Robot and cell files as TOML, both ways: the parts that several files of this module share.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "calib/files/toml.h"
#include "calib/model/error.h"
#include "calib/model/robot.h"
#include "calib/model/units.h"

namespace cellcal::calib {

// Identification in a cell file: serial numbers, certificates, names. A certificate prints it from the file's
// text; no computation uses it, so it is not part of a Cell.

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

// Keys that robot, cell and obstacles share.

inline constexpr Range kLengthMm{-1e5, 1e5};  // 100 m: above any arm or cell
inline constexpr Range kAngleDeg{-3600.0, 3600.0};

/// Unit of a number in a file.
struct FileUnit {
  double (*to_si)(double in_file);
  double (*to_file)(double si);
};
inline constexpr FileUnit kSi{[](double v) { return v; }, [](double v) { return v; }};
/// mm, mm/m, mrad, ms.
inline constexpr FileUnit kMilli{[](double v) { return v / 1000.0; },
                                 [](double v) { return v * 1000.0; }};
/// A radius, by its diameter in mm.
inline constexpr FileUnit kDiameterMm{[](double v) { return v / 2000.0; },
                                      [](double v) { return v * 2000.0; }};
inline constexpr FileUnit kDeg{[](double v) { return v * kRadPerDeg; },
                               [](double v) { return v * kDegPerRad; }};
inline constexpr FileUnit kArcsec{[](double v) { return v * kRadPerArcsec; },
                                  [](double v) { return v / kRadPerArcsec; }};

enum class Stated {
  kNeeded,  ///< required
  kAlways,  ///< always written, but not required
  kIfOther  ///< written unless it has the usual value
};
using enum Stated;

/// A number of T by its key, both ways.
template <class T>
struct NumberKey {
  const char* key;
  double T::*member;
  FileUnit unit;
  Range range;  ///< in the file's unit
  Stated stated = Stated::kIfOther;
  double T::*written_with = nullptr;  ///< written if that member is above 0
};

/// An absent key leaves its member unchanged.
template <class T, std::size_t N>
void read_numbers(const TomlTable& table, const NumberKey<T> (&keys)[N], T& value) {
  for (const NumberKey<T>& row : keys)
    if (table.has(row.key) || row.stated == Stated::kNeeded)
      value.*row.member = row.unit.to_si(table.number(row.key, row.range));
}

/// "KEY = VALUE" as a line.
std::string number_line(const char* key, double value);

template <class T, std::size_t N>
std::string numbers_to_toml(const NumberKey<T> (&keys)[N], const T& value, const T& usual = {}) {
  std::string out;
  for (const NumberKey<T>& row : keys)
    if (row.written_with ? value.*row.written_with > 0.0
                         : row.stated != Stated::kIfOther || value.*row.member != usual.*row.member)
      out += number_line(row.key, row.unit.to_file(value.*row.member));
  return out;
}

/// Three numbers as an array.
Eigen::Vector3d read_vector(const TomlTable& table, std::string_view key, Range range);
std::string vector_to_toml(const Eigen::Vector3d& v);

/// `xyz_mm` and `abc_deg`, which may be absent.
Eigen::Isometry3d read_frame(const TomlTable& table, bool needs_place = true);
std::string frame_to_toml(const Eigen::Isometry3d& frame);

/// `mass_kg` and `com_mm`, which may be absent.
void read_mass(const TomlTable& table, double& mass_kg, Eigen::Vector3d& com_m);
std::string mass_to_toml(double mass_kg, const Eigen::Vector3d& com_m);

// Triangle meshes from CAD: STL, ASCII and binary, in millimetres.

/// Maximum number of triangles: the furniture of a cell needs hundreds.
inline constexpr std::size_t kMostTriangles = 400'000;

/// Triangles of all solids; normals are ignored, triangles without an area are omitted, and so is what follows the
/// last one of a binary file. Throws FileError naming the line (ASCII) or the byte (binary), or the format that the
/// file has instead. `name` denotes the file.
Mesh parse_stl(std::string_view bytes, const std::string& name);
Mesh load_stl(const std::filesystem::path& path);

}  // namespace cellcal::calib
