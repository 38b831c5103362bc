#pragma once
// Single waves of the joints' gears: a pinion's or a wave generator's order, faster than a smooth
// function of the angle can follow from touch to touch, is one sine and one cosine. All orders of all
// joints are tried against what the touches leave.

#include "calib/estimate/estimate.h"

namespace cellcal::calib {

struct FoundWaves {
  Robot robot;  ///< of the problem, its joints with the waves found
  int count = 0;
  /// Gain of log evidence that they need beyond chance, all orders of all joints having been tried.
  double required_gain = 0.0;
};

/// Adds wave by wave the one that raises the restricted likelihood most, until none raises it by
/// more than the search among all of them gains by chance, (27e). `e`: the estimate of `problem`.
FoundWaves find_waves(const Problem& problem, const Estimate& e);

}  // namespace cellcal::calib
