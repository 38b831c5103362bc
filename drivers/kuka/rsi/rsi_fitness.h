#pragma once
// What the packets of a link are good for, judged in one place: sessions refuse by it, and doctor
// reports it.

#include "drivers/kuka/rsi/rsi_report.h"

namespace cellcal::drivers {

/// AIPos with fewer decimals is a hundredth of a degree or worse: 0.2 mm at 1.4 m.
inline constexpr int kFewestDecimals = 3;

enum class Fitness {
  kGood,
  kUsable,    ///< a session runs, and something that it could tell or bear is missing
  kUnproven,  ///< a session runs until it shows that this is too little
  kUnfit,     ///< no session moves the arm
};

/// How fine AIPos comes. A peer that is no controller may print "-90.0" for an exact -90: that
/// shows once its angles change.
Fitness fitness_of_decimals(const CoreState& state);
/// ASPos and Delay. Without Delay nobody knows that an increment was lost.
Fitness fitness_of_elements(const CoreState& state);

}  // namespace cellcal::drivers
