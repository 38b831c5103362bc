#include "calib/plan/plan.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <numbers>

#include "calib/files/files.h"
#include "calib/plan/candidates.h"
#include "calib/plan/duration.h"
#include "daemon/cli/exit_status.h"
#include "daemon/cli/offline.h"
#include "daemon/report/plan_picture.h"

namespace cellcal::daemon {

namespace {

/// The touch as it would be if arm and cell were exactly nominal.
calib::Touch nominal_touch(const calib::PlannedTouch& planned) {
  calib::Touch touch;
  touch.target = planned.target;
  touch.set = planned.set;
  const double fraction = planned.expected_m / planned.search_m;
  for (std::size_t i = 0; i < planned.standoff.size(); ++i) {
    touch.joint_rad.push_back(planned.standoff[i] +
                              fraction * (planned.end[i] - planned.standoff[i]));
  }
  return touch;
}

/// At the robot file's own axis speeds.
double minutes(const calib::Plan& plan, const calib::Robot& robot) {
  return calib::duration_s(plan, robot, {}) / 60.0;
}

std::string json(const calib::Plan& plan, const calib::Robot& robot) {
  constexpr double kDeg = 180.0 / std::numbers::pi;
  nlohmann::json list = nlohmann::json::array();
  for (const calib::PlannedTouch& planned : plan.touches) {
    nlohmann::json joints;
    const calib::Touch touch = nominal_touch(planned);
    for (std::size_t i = 0; i < robot.joints.size(); ++i) {
      joints[robot.joints[i].name] = touch.joint_rad[i] * kDeg;
    }
    list.push_back({{"target", planned.target},
                    {"set", planned.set == calib::TouchSet::kFit ? "fit" : "check"},
                    {"joints_deg", joints},
                    {"normal", {planned.normal.x(), planned.normal.y(), planned.normal.z()}},
                    {"search_mm", planned.search_m * calib::kMmPerM}});
  }
  return nlohmann::json{{"touches", list},
                        {"left_out", plan.left_out},
                        {"predicted_m3_mm", plan.predicted_m3_m * calib::kMmPerM},
                        {"predicted_u95_mm", plan.predicted_u95_m * calib::kMmPerM},
                        {"robot_minutes", minutes(plan, robot)}}
             .dump(1) +
         "\n";
}

std::string left_out_comment(const calib::Plan& plan, const calib::Cell& cell) {
  std::string lines;
  for (const std::string& id : plan.left_out)
    lines += "# left out: " + id + ", " +
             calib::why_not_planned(cell.targets[cell.target_index(id)]) + "\n";
  return lines;
}

}  // namespace

int plan(const PlanCommand& command) {
  const calib::Cell cell = calib::load_cell(command.cell);
  calib::PlanOptions options;
  options.fit_touches = command.touches;
  options.check_touches = command.check;
  options.seed = command.seed;
  options.interest = calib::parse_interest(command.region);
  const calib::Plan made = calib::make_plan(cell, options);
  if (!command.picture.empty()) put(plan_svg(cell, made), command.picture);
  if (command.json) {
    put(json(made, cell.robot), command.output);
    return kSuccess;
  }
  std::vector<calib::Touch> touches;
  for (const calib::PlannedTouch& planned : made.touches) touches.push_back(nominal_touch(planned));
  put("# planned on nominal geometry, not measured\n" + left_out_comment(made, cell) +
          fmt::format(
              "# predicted over the region ({}): mean error {:.3f} mm, u95 {:.3f} mm; robot time "
              "{:.1f} min at its own speeds\n",
              command.region, made.predicted_m3_m * calib::kMmPerM,
              made.predicted_u95_m * calib::kMmPerM, minutes(made, cell.robot)) +
          calib::format_touches(touches, cell.robot),
      command.output);
  return kSuccess;
}

}  // namespace cellcal::daemon
