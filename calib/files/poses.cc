#include "calib/files/poses.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "calib/files/csv.h"
#include "calib/files/input_file.h"
#include "calib/files/text.h"
#include "calib/files/touches.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

constexpr std::array<const char*, 6> kPose = {"x_mm", "y_mm", "z_mm", "a_deg", "b_deg", "c_deg"};
constexpr std::size_t kMaxPoses = 2'000'000;
/// Beyond the reach and the turns of any arm: detects other units.
constexpr double kFarthestMm = 1e5, kMostDeg = 3600.0;

std::array<int, 6> pose_columns(const CsvTable& table, const std::string& name) {
  std::array<int, 6> columns{};
  for (std::size_t i = 0; i < kPose.size(); ++i) {
    columns[i] = table.find(kPose[i]);
    if (columns[i] < 0)
      throw FileError(name,
                      fmt::format(":{}: no column \"{}\"; x_mm,y_mm,z_mm,a_deg,b_deg,c_deg are "
                                  "needed, in the robot's base frame",
                                  table.header_line(), kPose[i]));
  }
  return columns;
}

double bounded(const CsvTable& table, int column, double most, const char* unit) {
  const double value = table.number(column);
  if (std::abs(value) > most)
    table.fail(column, fmt::format("{} {} is out of range", shown(table.text(column)), unit));
  return value;
}

}  // namespace

std::vector<PoseRow> parse_poses(std::string_view text, const std::string& name,
                                 const Robot& robot) {
  CsvTable table(text, name);
  const std::vector<std::string> joints = joint_names(robot);
  std::vector<std::string> known(kPose.begin(), kPose.end());
  known.insert(known.end(), joints.begin(), joints.end());
  table.refuse_unknown(known);
  const auto pose = pose_columns(table, name);
  const bool seeded = std::any_of(joints.begin(), joints.end(),
                                  [&](const std::string& joint) { return table.find(joint) >= 0; });
  const std::vector<int> seed = seeded ? joint_columns(table, robot, name) : std::vector<int>{};
  std::vector<PoseRow> rows;
  while (table.next()) {
    if (rows.size() == kMaxPoses) throw FileError(name, ": more than 2000000 rows");
    FrameMmDeg frame;
    for (std::size_t i = 0; i < 3; ++i) {
      frame.xyz_mm[i] = bounded(table, pose[i], kFarthestMm, "mm");
      frame.abc_deg[i] = bounded(table, pose[i + 3], kMostDeg, "deg");
    }
    rows.push_back({to_isometry(frame), read_joints(table, robot, seed), table.line()});
  }
  return rows;
}

std::vector<PoseRow> load_poses(const std::filesystem::path& path, const Robot& robot) {
  const std::string text = read_file(path);
  return parse_poses(text, path.string(), robot);
}

}  // namespace cellcal::calib
