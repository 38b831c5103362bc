// cellcal correct --poses.

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <span>

#include "calib/estimate/external_axes.h"
#include "calib/estimate/predict.h"
#include "calib/export/corrector.h"
#include "calib/files/files.h"
#include "calib/files/touches.h"
#include "calib/model/enum_table.h"
#include "calib/model/error.h"
#include "calib/model/units.h"
#include "calib/plan/cell_check.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/correct.h"
#include "daemon/cli/offline.h"
#include "daemon/cli/on_positioner.h"

namespace cellcal::daemon {

namespace {

using calib::kDegPerRad;
using calib::NotReached;
using calib::Reach;
using calib::Reached;

/// In the base frame; on an axis of the positioner from where it is as found.
Eigen::Isometry3d in_base(const calib::Calibration& calibration, const calib::PoseRow& row,
                          int carriers) {
  if (carriers == 0) return row.tcp;
  const std::span<const double> angles(row.positioner_rad);
  const auto count = static_cast<std::size_t>(carriers);
  return calib::carried_as_found(calibration, angles.first(count), angles.subspan(count)) * row.tcp;
}

/// A row without seed continues from the previous one, the first from the middle of the joint ranges.
std::vector<Reach> reached(const calib::Calibration& calibration,
                           const std::vector<calib::PoseRow>& rows, int carriers) {
  const calib::Corrector corrector(calibration);
  calib::JointVector last = corrector.middle();
  std::vector<Reach> all;
  for (const calib::PoseRow& row : rows) {
    const Eigen::Isometry3d tcp = in_base(calibration, row, carriers);
    all.push_back(row.seed_rad.empty() ? corrector.nearest(tcp, last)
                                       : corrector.joints(tcp, row.seed_rad));
    if (const auto* at = std::get_if<Reached>(&all.back())) last = at->joint_rad;
  }
  return all;
}

/// With the positioner's angles of each row, where the poses are on it.
std::string joints_csv(const calib::Robot& robot, const std::vector<Reach>& all,
                       const std::vector<calib::PoseRow>& rows, bool on_axis) {
  std::string text;
  for (const calib::Joint& joint : robot.joints) text += (text.empty() ? "" : ",") + joint.name;
  for (const calib::PositionerAxis& axis : robot.positioner)
    if (on_axis) text += "," + axis.name;
  text += "\n";
  for (std::size_t i = 0; i < all.size(); ++i) {
    std::string row;
    const calib::JointVector& q = std::get<Reached>(all[i]).joint_rad;
    // Ten decimals of a degree are 3e-9 mm at 1.4 m.
    for (std::size_t k = 0; k < q.size(); ++k)
      row +=
          fmt::format("{}{:.10f}", row.empty() ? "" : ",", q[k] * unit_of(robot.joints[k]).per_si);
    for (const double e : rows[i].positioner_rad)
      if (on_axis) row += fmt::format(",{:.10f}", e * kDegPerRad);
    text += row + "\n";
  }
  return text;
}

nlohmann::json reach_json(const calib::Robot& robot, const Reach& reach,
                          const calib::Predictor& predictor, std::span<const double> carrier_rad) {
  nlohmann::json one;
  if (const auto* reason = std::get_if<NotReached>(&reach)) {
    one["unreached"] = {{"why", own_name(reason->why)}, {"words", calib::words(*reason, robot)}};
    if (reason->joint >= 0) {
      const calib::Joint& joint = robot.joints[static_cast<std::size_t>(reason->joint)];
      one["unreached"]["joint"] = joint.name;
      one["unreached"][unit_of(joint).name] = reason->joint_rad * unit_of(joint).per_si;
    }
    return one;
  }
  const auto& at = std::get<Reached>(reach);
  for (std::size_t i = 0; i < at.joint_rad.size(); ++i) {
    const calib::JointUnit unit = unit_of(robot.joints[i]);
    one[std::string("joints_") + unit.name][robot.joints[i].name] = at.joint_rad[i] * unit.per_si;
  }
  one["off_mm"] = at.off_m * calib::kMmPerM;
  one["u95_mm"] = predictor.calibrated(at.joint_rad, carrier_rad).u95_m * calib::kMmPerM;
  return one;
}

/// Returns the number of unreachable poses and prints the first of them.
std::size_t name_unreached(const CorrectCommand& command, const calib::Robot& robot,
                           const std::vector<calib::PoseRow>& rows, const std::vector<Reach>& all) {
  constexpr std::size_t kInWords = 20;
  std::size_t count = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto* reason = std::get_if<NotReached>(&all[i]);
    if (reason == nullptr || ++count > kInWords) continue;
    fmt::print(stderr, "{}\n",
               say({"say.correct.unreached",
                    {{"file", command.poses.string()},
                     {"line", rows[i].line},
                     {"why", calib::phrase(*reason, robot)}}}));
  }
  if (count > kInWords)
    fmt::print(stderr, "{}\n", say({"say.correct.unreached.more", {{"n", count - kInWords}}}));
  return count;
}

/// No tip comes so near to the base's origin; on an axis of the positioner it may.
void examine_unit(const CorrectCommand& command, const std::vector<Eigen::Vector3d>& tcps_m) {
  double farthest_m = 0.0;
  for (const Eigen::Vector3d& tcp_m : tcps_m) farthest_m = std::max(farthest_m, tcp_m.norm());
  if (tcps_m.empty() || farthest_m >= calib::kNearestCentreM) return;
  const std::string words = fmt::format(
      ": {} poses, all within {:.3f} mm of {}: x_mm, y_mm, z_mm may be in metres. State them in millimetres, or name "
      "the columns x_m, y_m, z_m",
      tcps_m.size(), farthest_m * calib::kMmPerM,
      command.on.empty() ? "the base's origin" : "the origin of " + command.on);
  if (command.on.empty()) throw calib::FileError(command.poses.string(), words);
  fmt::print(stderr, "warning: {}{}\n", command.poses.string(), words);
}

}  // namespace

int correct_poses(const CorrectCommand& command, const calib::Calibration& calibration) {
  const calib::Robot& robot = calibration.cell.robot;
  const int carriers = carriers_of(robot, command.on);
  const auto rows = calib::load_poses(command.poses, robot);
  report_reading(command.poses, robot);
  if (robot.first_turning() > 0 && !rows.empty() && rows.front().seed_rad.empty())
    throw calib::FileError(
        command.poses.string(),
        fmt::format(
            ": no columns of the joints. {0} carries the arm, and where it stands has to be stated: add {0} in mm "
            "and the angles near the pose, A1 to A6",
            robot.joints.front().name));
  std::vector<Eigen::Vector3d> tcps_m;
  std::vector<std::vector<double>> angles;
  std::vector<calib::JointVector> seeds;
  for (const calib::PoseRow& row : rows) {
    tcps_m.push_back(row.tcp.translation());
    seeds.push_back(row.seed_rad);
    if (!row.positioner_rad.empty()) angles.push_back(row.positioner_rad);
  }
  examine_unit(command, tcps_m);
  warn_of_radians(command.poses, robot, seeds);
  if (!rows.empty()) angles = carrier_angles(std::move(angles), carriers, command.poses, robot);
  const std::vector<Reach> all = reached(calibration, rows, carriers);
  const std::size_t unreached = name_unreached(command, robot, rows, all);
  warn_outside_scope(calibration, tcps_m, angles);
  if (command.json) {
    const calib::Predictor predictor(calibration, carriers);
    nlohmann::json list = nlohmann::json::array();
    for (std::size_t i = 0; i < all.size(); ++i) {
      list.push_back(reach_json(robot, all[i], predictor,
                                carriers > 0 ? angles[i] : std::span<const double>{}));
      list.back()["line"] = rows[i].line;
    }
    put(list.dump(1) + "\n", command.output);
  } else if (unreached == 0) {
    put_as([&](const auto& text, const auto& name) { calib::parse_joints(text, name, robot); },
           joints_csv(robot, all, rows, carriers > 0), command.output);
  }
  return unreached == 0 ? kSuccess : kJobFailed;
}

}  // namespace cellcal::daemon
