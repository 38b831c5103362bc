#pragma once
// Reading and writing of the public file formats. Millimetres and degrees outside, SI and radians
// inside. All functions throw FileError.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "calib/model/error.h"
#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/model/units.h"

namespace cellcal::calib {

/// Robot file, format "cellcal.robot/1".
Robot load_robot(const std::filesystem::path& path);

/// The robot of this file, or the shipped robot of this name ("kr5_r1400").
Robot load_named_robot(const std::string& name);

/// Cell file, format "cellcal.cell/1", with the robot file that it names (a path relative to the
/// cell file, or the name of a shipped robot, see robots_directories()) and its obstacles' meshes.
Cell load_cell(const std::filesystem::path& path);

/// Maximum number of triangles in the meshes of one cell; each costs a plan 0.7 kB.
inline constexpr std::size_t kMostTrianglesOfCell = 1'000'000;
/// Reads the STL files of mesh obstacles, relative to `folder`, each once. A cell read from a
/// calibration or a journal has no meshes until then; only plans need them.
void load_meshes(Cell& cell, const std::filesystem::path& folder,
                 std::size_t most_triangles = kMostTrianglesOfCell);

/// A cell file and the robot file that it names, located as by load_cell(). Each is read once, so
/// that the text hashed or stored is the text parsed.
struct CellText {
  std::string cell_name, cell_text;  ///< path as given, and content
  std::string robot_name, robot_text;
};
CellText read_cell_text(const std::filesystem::path& path);
/// The cell, without its obstacles' meshes.
Cell parse_cell(const CellText& text);

/// Search path of the shipped robots: $CELLCAL_ROBOTS, share/cellcal/robots of the installation
/// prefix of this library or program, calib/robots of the source tree that it was built in,
/// /usr/share/cellcal/robots. No path is compiled in, so an installation may be moved.
std::vector<std::filesystem::path> robots_directories();

/// Touches of a CSV; joints are matched by the robot's joint names, targets by the cell's.
std::vector<Touch> load_touches(const std::filesystem::path& path, const Cell& cell);
/// From text; `name` denotes the file in messages.
std::vector<Touch> parse_touches(std::string_view text, const std::string& name, const Cell& cell);
std::string format_touches(const std::vector<Touch>& touches, const Robot& robot);

/// Rows of joint angles.
struct JointRows {
  std::vector<std::vector<double>> joint_rad;
  /// Angles of all of the positioner's axes, a row each; empty: not in the file.
  std::vector<std::vector<double>> positioner_rad;
  /// Number of rows with an angle far outside its joint's limits, which no touch can have; the
  /// first few are described.
  std::size_t beyond_limits = 0;
  std::vector<std::string> beyond_limits_words;
};
/// Joint columns, and those of a positioner, all or none, for prediction: any angle. Other columns are
/// refused.
JointRows load_joints(const std::filesystem::path& path, const Robot& robot);
JointRows parse_joints(std::string_view text, const std::string& name, const Robot& robot);

}  // namespace cellcal::calib
