#include "calib/plan/plan.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "calib/files/files.h"
#include "calib/model/long_work.h"
#include "calib/model/units.h"
#include "calib/plan/candidates.h"
#include "calib/plan/cell_check.h"
#include "calib/plan/duration.h"
#include "daemon/cli/offline/exit_status.h"
#include "daemon/cli/offline/offline.h"
#include "daemon/files/correction_limit.h"
#include "daemon/report/drawing/plan_picture.h"

namespace cellcal::daemon {

namespace {

/// Progress of planning, on a terminal only. Ctrl-C ends the program as everywhere.
class PercentOnTerminal {
 public:
  ~PercentOnTerminal() {
    if (terminal_) std::fputs("\r\033[K", stderr);
  }
  void show(const calib::WorkDone& done) const {
    if (terminal_) fmt::print(stderr, "\rplanning {:.0f} %", 100.0 * done.share);
  }

 private:
  bool terminal_ = ::isatty(STDERR_FILENO) == 1;
};

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

/// Where the arm stands, or where the plan would have it.
calib::JointVector begin_of(const PlanCommand& command, const calib::Robot& robot) {
  calib::JointVector begin;
  for (const double deg : command.from_deg) begin.push_back(deg * calib::kRadPerDeg);
  if (!begin.empty() && begin.size() != robot.joints.size())
    throw std::runtime_error(fmt::format("--from: {0} angles, {2} joints in {1}", begin.size(),
                                         robot.name, robot.joints.size()));
  for (std::size_t i = 0; i < begin.size(); ++i)
    if (begin[i] < robot.joints[i].min_rad || begin[i] > robot.joints[i].max_rad)
      throw std::runtime_error(fmt::format("--from: {1:g} deg for {0} is outside of its limits",
                                           robot.joints[i].name, command.from_deg[i]));
  return begin;
}

std::string foreseen_words(const std::string& region, const calib::Plan& plan,
                           const calib::Robot& robot) {
  return fmt::format(
      "predicted mean error {1:.3f} mm, u95 {2:.3f} mm ({0}); robot time {3:.1f} min at the "
      "robot file's axis speeds",
      region, plan.predicted_mean_m * calib::kMmPerM, plan.predicted_u95_m * calib::kMmPerM,
      minutes(plan, robot));
}

std::string travel_words(const LimitNeeded& needed, const calib::Plan& plan,
                         const calib::Robot& robot) {
  std::string begin;
  for (std::size_t i = 0; i < robot.joints.size(); ++i)
    begin += fmt::format("{}{:.0f}", i == 0 ? "" : ",", plan.start[i] * calib::kDegPerRad);
  return fmt::format(
      "largest axis travel {1:.1f} deg ({0}) from {2}. Over RSI set correction_limit_deg to at "
      "least {3:.0f}; {4:.0f} also covers a session that begins or is resumed anywhere on its "
      "way",
      needed.axis, needed.turn_deg, begin, needed.limit_deg,
      std::min(needed.anywhere_deg, kWidestLimitDeg));
}

std::string json(const calib::Plan& plan, const calib::Robot& robot, const LimitNeeded& needed) {
  nlohmann::json list = nlohmann::json::array();
  for (const calib::PlannedTouch& planned : plan.touches) {
    nlohmann::json joints;
    const calib::Touch touch = nominal_touch(planned);
    for (std::size_t i = 0; i < robot.joints.size(); ++i) {
      joints[robot.joints[i].name] = touch.joint_rad[i] * calib::kDegPerRad;
    }
    list.push_back({{"target", planned.target},
                    {"set", to_string(planned.set)},
                    {"joints_deg", joints},
                    {"normal", {planned.normal.x(), planned.normal.y(), planned.normal.z()}},
                    {"search_mm", planned.search_m * calib::kMmPerM}});
  }
  return nlohmann::json{{"touches", list},
                        {"left_out", plan.left_out},
                        {"predicted_m3_mm", plan.predicted_mean_m * calib::kMmPerM},
                        {"predicted_u95_mm", plan.predicted_u95_m * calib::kMmPerM},
                        {"farthest_turn_deg", needed.turn_deg},
                        {"correction_limit_deg", needed.limit_deg},
                        {"correction_limit_anywhere_deg", needed.anywhere_deg},
                        {"robot_minutes", minutes(plan, robot)}}
             .dump(1) +
         "\n";
}

std::string left_out_comment(const calib::Plan& plan, const calib::Cell& cell) {
  std::string lines;
  for (const std::string& id : plan.left_out) {
    const auto why = calib::why_not_planned(cell.targets[cell.target_index(id)]);
    lines += "# left out: " + id + ", " + (why ? calib::words(*why) : "") + "\n";
  }
  return lines;
}

}  // namespace

int plan(const PlanCommand& command) {
  const calib::Cell cell = calib::load_cell(command.cell);
  for (const std::string& warning : calib::refuse_faulty(cell))
    fmt::print(stderr, "warning: {}\n", warning);
  calib::PlanOptions options;
  options.fit_touches = command.touches;
  options.check_touches = command.check;
  options.seed = command.seed;
  options.region = calib::parse_accuracy_region(command.region);
  if (command.suggest_spheres > 0) return suggest_spheres(command, cell, options);
  const calib::Plan made = [&] {
    const PercentOnTerminal percent;
    const calib::Watch watch([] { return false; },
                             [&](const calib::WorkDone& done) { percent.show(done); });
    return calib::make_plan(cell, options, begin_of(command, cell.robot));
  }();
  if (const auto fault = calib::fault_of(cell, made))
    fmt::print(stderr, "warning: {}\n", words(*fault));
  const LimitNeeded needed = limit_needed(made, cell.robot, made.start);
  if (!command.picture.empty()) put(plan_svg(cell, made), command.picture);
  if (command.json) {
    put(json(made, cell.robot, needed), command.output);
    return kSuccess;
  }
  std::vector<calib::Touch> touches;
  for (const calib::PlannedTouch& planned : made.touches) touches.push_back(nominal_touch(planned));
  const std::string foreseen = foreseen_words(command.region, made, cell.robot);
  const std::string travel = travel_words(needed, made, cell.robot);
  put("# planned with nominal geometry, not measured\n" + left_out_comment(made, cell) + "# " +
          foreseen + "\n# " + travel + "\n" + calib::format_touches(touches, cell.robot),
      command.output);
  if (!command.output.empty())
    put(fmt::format("{}: {} touches written\n{}\n{}\n", command.output.string(),
                    made.touches.size(), foreseen, travel),
        {});
  return kSuccess;
}

}  // namespace cellcal::daemon
