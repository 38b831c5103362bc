#pragma once
// Suitability of a link's packets, used both for refusing sessions and for the doctor's report.

#include "drivers/kuka/rsi/rsi_report.h"

namespace cellcal::drivers {

/// AIPos with fewer decimals has a resolution of a hundredth of a degree or worse: 0.2 mm at 1.4 m.
inline constexpr int kFewestDecimals = 3;

enum class Fitness {
  kGood,
  kUsable,    ///< a session runs, with reduced diagnostics or robustness
  kUnproven,  ///< a session runs until the packets prove insufficient
  kUnfit,     ///< no session moves the arm
};

/// Resolution of AIPos. A peer other than a controller may print "-90.0" for an exact -90: the
/// resolution shows once its angles change.
Fitness fitness_of_decimals(const CoreState& state);
/// ASPos and Delay. Without Delay the loss of an increment is not detectable.
Fitness fitness_of_elements(const CoreState& state);

}  // namespace cellcal::drivers
