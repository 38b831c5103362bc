#include "daemon/files/correction_limit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calib/model/units.h"

namespace cellcal::daemon {

namespace {

using calib::kDegPerRad;
/// Margin for a start that differs from the plan's, and for paths found during the session.
constexpr double kMarginDeg = 5.0;
constexpr double kRoundDeg = 10.0;

double round_limit_deg(double turn_deg) {
  return kRoundDeg * std::ceil((turn_deg + kMarginDeg) / kRoundDeg);
}

}  // namespace

LimitNeeded limit_needed(const calib::Plan& plan, const calib::Robot& robot,
                         const calib::JointVector& begin, std::size_t next) {
  calib::AxisTravel travel = calib::axis_travel(plan, begin, next);
  // A linear unit's travel is no angle.
  for (std::size_t i = 0; i < robot.first_turning(); ++i)
    travel.low_rad[i] = travel.high_rad[i] = begin.at(i);
  const calib::Turn turn = travel.from(begin), range = travel.from_anywhere();
  LimitNeeded needed;
  needed.axis = robot.joints.at(turn.axis).name;
  needed.turn_deg = turn.angle_rad * kDegPerRad;
  needed.limit_deg = round_limit_deg(needed.turn_deg);
  needed.widest_axis = robot.joints.at(range.axis).name;
  needed.range_deg = range.angle_rad * kDegPerRad;
  needed.anywhere_deg = round_limit_deg(needed.range_deg);
  return needed;
}

double advised_limit_deg(const LimitNeeded& needed) {
  return std::min(needed.anywhere_deg, kWidestLimitDeg);
}

std::string widen_words(const LimitNeeded& needed) {
  const std::string nearer = "jog the arm to the middle of its planned travel";
  if (needed.turn_deg > kWidestLimitDeg) return nearer;
  const double anywhere = advised_limit_deg(needed);
  const double now = std::min(needed.limit_deg, kWidestLimitDeg);
  return fmt::format(
      "set correction_limit_deg = {:.0f} in [rsi]{}, make the controller's files again "
      "('cellcal kuka-files': AXISCORR and AXISCORRMON have the limit, too), copy them to the "
      "controller and cold-start it; or {}",
      anywhere,
      now < anywhere
          ? fmt::format(" ({:.0f} is enough from here, but not where the session may be resumed)",
                        now)
          : "",
      nearer);
}

std::string beyond_limit_words(const LimitNeeded& needed, double limit_deg) {
  return fmt::format(
      "{1:.1f} deg travel of {0} from where the session begins, correction_limit_deg is {2:g}. "
      "Nothing has moved. Do one of these: {3}",
      needed.axis, needed.turn_deg, limit_deg, widen_words(needed));
}

}  // namespace cellcal::daemon
