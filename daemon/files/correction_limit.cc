#include "daemon/files/correction_limit.h"

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

calib::Phrase widen_phrase(const LimitNeeded& needed) {
  if (needed.turn_deg > kWidestLimitDeg) return "say.limit.jog";
  const double anywhere = advised_limit_deg(needed);
  const double now = std::min(needed.limit_deg, kWidestLimitDeg);
  return {now < anywhere ? "say.limit.widen.or_less" : "say.limit.widen",
          {{"deg", anywhere}, {"less", now}}};
}

std::string beyond_limit_words(const LimitNeeded& needed, double limit_deg) {
  return calib::words({"say.limit.beyond",
                       {{"axis", needed.axis},
                        {"deg", needed.turn_deg},
                        {"limit", limit_deg},
                        {"do", widen_phrase(needed)}}});
}

}  // namespace cellcal::daemon
