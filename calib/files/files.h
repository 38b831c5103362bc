#pragma once
// Reading and writing of the files that others rely on. Millimetres and degrees outside, SI and
// radians inside. All functions throw FileError.

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

/// The robot of this file, or the shipped one of this name ("kr5_r1400").
Robot load_named_robot(const std::string& name);

/// Cell file, format "cellcal.cell/1", with the robot file that it names: relative to the cell
/// file, or the name of a shipped robot (see robots_directory()), and with its obstacles' meshes.
Cell load_cell(const std::filesystem::path& path);

/// More triangles than this are refused in the meshes of one cell; each costs a plan 0.7 kB.
inline constexpr std::size_t kMostTrianglesOfCell = 1'000'000;
/// Reads the STL files of mesh obstacles, which lie relative to `folder`, each once. A cell that
/// comes out of a calibration or a journal has none until then; only plans need them.
void load_meshes(Cell& cell, const std::filesystem::path& folder,
                 std::size_t most_triangles = kMostTrianglesOfCell);

/// A cell file and the robot file that it names, found as load_cell finds it. Each is read once:
/// what is hashed or kept is what was understood.
struct CellText {
  std::string cell_name, cell_text;  ///< path as given, and content
  std::string robot_name, robot_text;
};
CellText read_cell_text(const std::filesystem::path& path);
/// The cell, without its obstacles' meshes.
Cell parse_cell(const CellText& text);

/// Where the shipped robots may lie: $CELLCAL_ROBOTS, share/cellcal/robots of the prefix that this
/// library or program is installed under, calib/robots of the source tree that it was built in,
/// /usr/share/cellcal/robots. No place is compiled in, so an installation may be moved.
std::vector<std::filesystem::path> robots_directories();

/// The touches of a CSV; joints are matched by the robot's joint names, targets by the cell's.
std::vector<Touch> load_touches(const std::filesystem::path& path, const Cell& cell);
/// Same from text; `name` stands for the file in messages.
std::vector<Touch> parse_touches(std::string_view text, const std::string& name, const Cell& cell);
std::string format_touches(const std::vector<Touch>& touches, const Robot& robot);

/// Rows of joint angles.
struct JointRows {
  std::vector<std::vector<double>> joint_rad;
  /// Rows with an angle that no touch could have had, far outside its joint's limits; of the first
  /// few which angle it is.
  std::size_t beyond_limits = 0;
  std::vector<std::string> beyond_limits_words;
};
/// Joint columns only, for predict: any angle. Columns beside the joints are refused.
JointRows load_joints(const std::filesystem::path& path, const Robot& robot);

}  // namespace cellcal::calib
