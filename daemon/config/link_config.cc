// Axes of the robot file as the adapters, and the controller's files, take them.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "calib/model/units.h"
#include "daemon/config/config.h"
#include "drivers/error.h"
#include "drivers/kuka/wire/wire_axes.h"
#include "drivers/units.h"

namespace cellcal::daemon {

namespace {

drivers::AxisLimit axis_limit(const MotionConfig& motion, const calib::Joint& joint) {
  const bool linear = joint.is_prismatic();
  return {joint.min_rad,
          joint.max_rad,
          joint.max_speed_rad_s * motion.speed_fraction,
          linear ? motion.travel_acceleration_m_s2 : motion.acceleration_rad_s2,
          linear ? motion.travel_jerk_m_s3 : motion.jerk_rad_s3,
          linear};
}

drivers::AxisLimit axis_limit(const MotionConfig& motion, const calib::PositionerAxis& axis) {
  double speed_rad_s = motion.positioner_speed_rad_s;
  if (axis.max_speed_rad_s > 0.0) speed_rad_s = std::min(speed_rad_s, axis.max_speed_rad_s);
  return {axis.min_rad, axis.max_rad, speed_rad_s, motion.positioner_acceleration_rad_s2,
          motion.positioner_jerk_rad_s3};
}

/// "robot file of NAME: ..."
template <class... T>
[[noreturn]] void refuse(const calib::Robot& robot, fmt::format_string<T...> words, T&&... values) {
  throw drivers::ConfigError("robot file of " + robot.name + ": " +
                             fmt::format(words, std::forward<T>(values)...));
}

/// The controller moves an arm of six axes, perhaps on a linear unit, and the axes of a positioner after them, in the robot
/// file's order and by the controller's names.
void check_axes(const calib::Robot& robot) {
  std::size_t number = robot.first_turning();
  if (robot.joints.size() != drivers::kArmAxes + number)
    refuse(
        robot,
        "{} joints, and sessions move arms of six turning axes, on a linear unit if there is one. "
        "Choose the robot file of the arm; others: 'cellcal identify'",
        robot.joints.size());
  for (const calib::PositionerAxis& axis : robot.positioner) {
    const std::string name = "E" + std::to_string(++number);
    if (axis.name != name)
      refuse(
          robot,
          "[[positioner]] {} is {} of the controller, behind the arm's axes. Name it so, also in the "
          "cell file",
          axis.name, name);
  }
}

/// Limits of the joints, followed by those of the positioner's axes.
std::vector<drivers::AxisLimit> axis_limits(const DaemonConfig& config, const calib::Cell& cell) {
  check_axes(cell.robot);
  std::vector<drivers::AxisLimit> limits;
  for (const calib::Joint& joint : cell.robot.joints) {
    if (!(joint.max_speed_rad_s > 0.0))
      refuse(cell.robot, "joint {} has no max_speed_{}. Add it: the arm cannot be moved without",
             joint.name, joint.is_prismatic() ? "mm_s" : "deg_s");
    limits.push_back(axis_limit(config.motion, joint));
  }
  for (const calib::PositionerAxis& axis : cell.robot.positioner)
    limits.push_back(axis_limit(config.motion, axis));
  return limits;
}

/// The controller's own, likewise. Where a positioner's is not stated: over RSI that of its turns, over EKI, whose
/// commands state a share of it, any.
std::vector<double> full_speeds(const calib::Robot& robot, double of_positioner_rad_s) {
  std::vector<double> speeds;
  for (const calib::Joint& joint : robot.joints) speeds.push_back(joint.max_speed_rad_s);
  for (const calib::PositionerAxis& axis : robot.positioner)
    speeds.push_back(axis.max_speed_rad_s > 0.0 ? axis.max_speed_rad_s : of_positioner_rad_s);
  return speeds;
}

/// Ranges of the external axes that a session moves, from E1 on: a linear unit's [mm], a positioner's [deg].
std::vector<drivers::AxisRange> external_ranges(const calib::Robot& robot) {
  std::vector<drivers::AxisRange> ranges;
  if (robot.first_turning() > 0)
    ranges.push_back({robot.joints[0].min_rad * drivers::kMmPerM,
                      robot.joints[0].max_rad * drivers::kMmPerM, true});
  // As in the robot file, for limits that can be read.
  const auto deg = [](double rad) { return std::round(rad * calib::kDegPerRad * 1e6) / 1e6; };
  for (const calib::PositionerAxis& axis : robot.positioner)
    ranges.push_back({deg(axis.min_rad), deg(axis.max_rad)});
  return ranges;
}

/// A turn through the whole range has to end within a session's time limit of a waypoint.
constexpr double kLongestTurnS = 150.0;

void check_turn_time(const calib::Robot& robot, double speed_rad_s) {
  for (const calib::PositionerAxis& axis : robot.positioner) {
    const double turn_s = (axis.max_rad - axis.min_rad) / speed_rad_s;
    if (turn_s > kLongestTurnS)
      refuse(
          robot,
          "[[positioner]] {} turns through its range in {} s, at most {} s are waited for. Raise "
          "[motion] positioner_speed_deg_s",
          axis.name, std::lround(turn_s), std::lround(kLongestTurnS));
  }
}

}  // namespace

MotionConfig slowed(MotionConfig motion, const calib::Robot& robot, double most_speed) {
  const double share = std::min(1.0, most_speed / motion.speed_fraction);
  motion.speed_fraction = std::min(motion.speed_fraction, most_speed);
  double least_rad_s = 0.0;
  for (const calib::PositionerAxis& axis : robot.positioner)
    least_rad_s = std::max(least_rad_s, (axis.max_rad - axis.min_rad) / kLongestTurnS);
  motion.positioner_speed_rad_s = std::max(share * motion.positioner_speed_rad_s,
                                           std::min(least_rad_s, motion.positioner_speed_rad_s));
  return motion;
}

drivers::RsiConfig rsi_config_for(const DaemonConfig& config, const calib::Cell& cell) {
  drivers::RsiConfig rsi = config.rsi;
  rsi.limits = axis_limits(config, cell);
  check_turn_time(cell.robot, config.motion.positioner_speed_rad_s);
  rsi.full_speed_rad_s = full_speeds(cell.robot, config.motion.positioner_speed_rad_s);
  rsi.correction_limit_deg.assign(rsi.limits.size(), config.rsi.correction_limit_deg.at(0));
  const std::vector<drivers::AxisRange> external = external_ranges(cell.robot);
  const drivers::WireAxes axes(rsi.limits);
  for (std::size_t i = 0; i < external.size(); ++i)
    rsi.correction_limit_deg.at(axes.at_place(drivers::kArmAxes + i)) =
        drivers::travel_limit(external[i]);
  if (rsi.space.on) rsi.space.geometry = controller_arm(config, cell);
  rsi.validate();
  return rsi;
}

drivers::RsiFilesConfig rsi_files_for(const DaemonConfig& config, const calib::Cell& cell) {
  check_axes(cell.robot);
  drivers::RsiFilesConfig files = config.rsi_files;
  files.external = external_ranges(cell.robot);
  files.external_axes = std::max(files.external_axes, static_cast<int>(files.external.size()));
  for (const calib::Joint& joint : cell.robot.joints) {
    if (joint.is_prismatic()) continue;
    files.ranges_deg.push_back(
        {joint.min_rad * calib::kDegPerRad, joint.max_rad * calib::kDegPerRad});
  }
  return files;
}

drivers::EkiConfig eki_config_for(const DaemonConfig& config, const calib::Cell& cell) {
  drivers::EkiConfig eki = config.eki;
  const std::size_t axes = 6 + static_cast<std::size_t>(config.controller.external_axes);
  const std::size_t joints = cell.robot.joints.size(), turning = cell.robot.positioner.size();
  // External axes without a joint hold still.
  if (joints + turning > axes)
    refuse(cell.robot,
           "{} joints{}; the controller's EKI channel has {} axes (six, and [controller] "
           "external_axes, of which a linear unit is E1)",
           joints, turning > 0 ? fmt::format(" and {} axes of a positioner", turning) : "", axes);
  eki.external_axes = config.controller.external_axes;
  eki.limits = axis_limits(config, cell);
  constexpr double kAnyFullSpeed = 1.0;
  eki.full_speed_rad_s = full_speeds(cell.robot, kAnyFullSpeed);
  for (std::size_t i = joints; i < eki.limits.size(); ++i) {
    const double full_rad_s = eki.full_speed_rad_s[i];
    double& most_rad_s = eki.limits[i].max_speed_rad_s;
    most_rad_s = full_rad_s * config.motion.speed_fraction;
    if (cell.robot.positioner[i - joints].max_speed_rad_s > 0.0)
      most_rad_s = std::clamp(config.motion.positioner_speed_rad_s, 0.01 * full_rad_s, most_rad_s);
  }
  eki.validate();
  return eki;
}

}  // namespace cellcal::daemon
