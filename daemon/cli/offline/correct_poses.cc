#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "calib/estimate/predict.h"
#include "calib/export/corrector.h"
#include "calib/files/poses.h"
#include "calib/model/units.h"
#include "daemon/cli/offline/correct.h"
#include "daemon/cli/offline/exit_status.h"
#include "daemon/cli/offline/offline.h"

namespace cellcal::daemon {

namespace {

using calib::kDegPerRad;
using calib::NotReached;
using calib::Reach;
using calib::Reached;

const char* name_of(calib::Unreached why) {
  switch (why) {
    case calib::Unreached::kNotANumber:
      return "not_a_number";
    case calib::Unreached::kTooFar:
      return "too_far";
    case calib::Unreached::kBeyondLimit:
      return "beyond_limit";
    case calib::Unreached::kNearSingularity:
      return "near_singularity";
  }
  return "";
}

/// Rows without seed follow the row before them, the first the middle of the joints' ranges.
std::vector<Reach> reached(const calib::Calibration& calibration,
                           const std::vector<calib::PoseRow>& rows) {
  const calib::Corrector corrector(calibration);
  calib::JointVector last = corrector.middle();
  std::vector<Reach> all;
  for (const calib::PoseRow& row : rows) {
    all.push_back(row.seed_rad.empty() ? corrector.nearest(row.tcp, last)
                                       : corrector.joints(row.tcp, row.seed_rad));
    if (const auto* at = std::get_if<Reached>(&all.back())) last = at->joint_rad;
  }
  return all;
}

std::string csv(const calib::Robot& robot, const std::vector<Reach>& all) {
  std::string text;
  for (const calib::Joint& joint : robot.joints) text += (text.empty() ? "" : ",") + joint.name;
  text += "\n";
  for (const Reach& reach : all) {
    std::string row;
    // Ten decimals of a degree are 3e-9 mm at 1.4 m.
    for (const double q : std::get<Reached>(reach).joint_rad)
      row += fmt::format("{}{:.10f}", row.empty() ? "" : ",", q * kDegPerRad);
    text += row + "\n";
  }
  return text;
}

nlohmann::json json_of(const calib::Robot& robot, const Reach& reach,
                       const calib::Predictor& predictor) {
  nlohmann::json one;
  if (const auto* reason = std::get_if<NotReached>(&reach)) {
    one["unreached"] = {{"why", name_of(reason->why)}, {"words", calib::words(*reason, robot)}};
    if (reason->joint >= 0) {
      one["unreached"]["joint"] = robot.joints[static_cast<std::size_t>(reason->joint)].name;
      one["unreached"]["deg"] = reason->joint_rad * kDegPerRad;
    }
    return one;
  }
  const auto& at = std::get<Reached>(reach);
  for (std::size_t i = 0; i < at.joint_rad.size(); ++i)
    one["joints_deg"][robot.joints[i].name] = at.joint_rad[i] * kDegPerRad;
  one["off_mm"] = at.off_m * calib::kMmPerM;
  one["u95_mm"] = predictor.calibrated(at.joint_rad).u95_m * calib::kMmPerM;
  return one;
}

/// How many poses are not reached; the first of them are named.
std::size_t name_unreached(const CorrectCommand& command, const calib::Robot& robot,
                           const std::vector<calib::PoseRow>& rows, const std::vector<Reach>& all) {
  constexpr std::size_t kInWords = 20;
  std::size_t count = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto* reason = std::get_if<NotReached>(&all[i]);
    if (reason == nullptr || ++count > kInWords) continue;
    fmt::print(stderr, "cellcal correct: {}:{}: {}\n", command.poses.string(), rows[i].line,
               calib::words(*reason, robot));
  }
  if (count > kInWords)
    fmt::print(stderr, "cellcal correct: {} more poses are not reached\n", count - kInWords);
  return count;
}

}  // namespace

int correct_poses(const CorrectCommand& command, const calib::Calibration& calibration) {
  const calib::Robot& robot = calibration.cell.robot;
  const auto rows = calib::load_poses(command.poses, robot);
  const std::vector<Reach> all = reached(calibration, rows);
  const std::size_t unreached = name_unreached(command, robot, rows, all);
  if (command.json) {
    const calib::Predictor predictor(calibration);
    nlohmann::json list = nlohmann::json::array();
    for (std::size_t i = 0; i < all.size(); ++i) {
      list.push_back(json_of(robot, all[i], predictor));
      list.back()["line"] = rows[i].line;
    }
    put(list.dump(1) + "\n", command.output);
  } else if (unreached == 0) {
    put(csv(robot, all), command.output);
  }
  return unreached == 0 ? kSuccess : kJobFailed;
}

int correct(const CorrectCommand& command) {
  const auto calibration = usable_calibration("correct", command.calibration, command.withheld);
  if (!calibration) return kNotPublishable;
  return command.poses.empty() ? correct_krl(command, *calibration)
                               : correct_poses(command, *calibration);
}

}  // namespace cellcal::daemon
