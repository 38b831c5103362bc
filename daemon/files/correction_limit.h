#pragma once
// Travel of the axes in a session's plan, compared with [rsi] correction_limit_deg: an RSI controller adds
// corrections to the position at the start of its program, and the limit bounds those of each axis. A plan
// beyond the limit is refused before any motion, with the limit that it needs; plan and doctor predict it.

#include <string>

#include "calib/plan/duration.h"
#include "calib/words/phrase.h"

namespace cellcal::daemon {

/// Largest configurable value.
inline constexpr double kWidestLimitDeg = 360.0;

struct LimitNeeded {
  std::string axis;         ///< the axis with the largest travel from the start
  double turn_deg = 0.0;    ///< its travel
  double limit_deg = 0.0;   ///< rounded limit that permits this travel
  std::string widest_axis;  ///< the axis with the widest range over the whole path
  double range_deg = 0.0;
  double anywhere_deg = 0.0;  ///< rounded limit that permits a start or resume anywhere on the path
};

/// For the plan from touch `next` on, with the arm at `begin`.
LimitNeeded limit_needed(const calib::Plan& plan, const calib::Robot& robot,
                         const calib::JointVector& begin, std::size_t next = 0);

/// Recommended limit: sufficient for a resume anywhere on the path, bounded by the configurable maximum.
double advised_limit_deg(const LimitNeeded& needed);
/// "set correction_limit_deg = 240 ..., cold start"; where no limit is sufficient, another start position.
calib::Phrase widen_phrase(const LimitNeeded& needed);
/// The refusal, with its remedy, in English.
std::string beyond_limit_words(const LimitNeeded& needed, double limit_deg);

}  // namespace cellcal::daemon
