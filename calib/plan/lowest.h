#pragma once
// Lowest point that arm and tool reach on the moves of a plan. Without a stated floor only the hand is kept up (clearance.h).

#include <optional>

#include "calib/model/robot.h"
#include "calib/plan/planned_touch.h"
#include "calib/words/phrase.h"

namespace cellcal::calib {

/// Heights against gravity, base frame.
struct LowestPoint {
  double at_m = 0.0;    ///< of arm and tool, on nominal geometry, to 1 mm
  double feet_m = 0.0;  ///< of the arm's foot or the lowest stand, whichever is lower
};

/// Height of the arm's foot or of the lowest stand on the floor, whichever is lower [m].
double feet_m(const Cell& cell);

/// Empty with a stated floor, and where the plan stays above all feet.
std::optional<LowestPoint> below_feet(const Cell& cell, const Plan& plan);

Phrase found_phrase(const LowestPoint& lowest);
/// How to keep the arm up.
Phrase floor_advice_phrase(const LowestPoint& lowest);
/// Both.
Phrase phrase(const LowestPoint& lowest);

}  // namespace cellcal::calib
