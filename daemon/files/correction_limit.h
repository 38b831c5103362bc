#pragma once
// How far a session's plan takes the axes from where it begins, beside [rsi] correction_limit_deg:
// an RSI controller adds corrections to where the arm stood when its program began, and the limit
// bounds each axis' own. What is too far is refused before anything moves, with the limit that is
// needed; plan and doctor foresee it.

#include <string>

#include "calib/plan/duration.h"

namespace cellcal::daemon {

/// No configuration allows more.
inline constexpr double kWidestLimitDeg = 360.0;

struct LimitNeeded {
  std::string axis;         ///< that goes farthest from where the session begins
  double turn_deg = 0.0;    ///< by so much
  double limit_deg = 0.0;   ///< a round limit that holds that
  std::string widest_axis;  ///< that has the widest range on the whole way
  double range_deg = 0.0;
  double anywhere_deg = 0.0;  ///< a round limit wherever on the way a session begins or is resumed
};

/// Of the plan from touch `next` on, with the arm at `begin`.
LimitNeeded limit_needed(const calib::Plan& plan, const calib::Robot& robot,
                         const calib::JointVector& begin, std::size_t next = 0);

/// What is advised, everywhere: wherever on its way a session may be resumed, as far as a configuration allows.
double advised_limit_deg(const LimitNeeded& needed);
/// "set correction_limit_deg = 240 ..., cold start"; where none is wide enough, another begin.
std::string widen_words(const LimitNeeded& needed);
/// What is refused, and what to do.
std::string beyond_limit_words(const LimitNeeded& needed, double limit_deg);

}  // namespace cellcal::daemon
