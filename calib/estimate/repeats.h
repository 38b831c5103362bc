#pragma once
// Touches of one place, again and again: what they differ by is the noise of a touch and nothing
// else. The arm's errors, whatever they are, are the same for all of them and cancel; so do the
// gears' ripple and wobble, which is why their mean is no better than one ripple.

#include <span>
#include <vector>

#include "calib/estimate/problem.h"

namespace cellcal::calib {

struct Repeats {
  std::vector<int> times;  ///< per touch: fit touches made at its place, itself included; 1: alone
  int touches = 0;         ///< that are repeats
  double scatter_m = 0.0;  ///< 1 sigma of one of them about its group's mean, pooled
  double degrees_of_freedom = 0.0;  ///< that the scatter rests on; 0: not measured
  double used_m = 0.0;              ///< noise of a touch that states none: stated and measured
};

/// Among the fit touches. Nothing is taken from touches that state their own sigma, nor from rows
/// that are the same to the last digit, which somebody copied.
Repeats find_repeats(const Problem& problem);
/// Weighs them so.
Repeats weigh_repeats(Problem& problem);
/// Whether the last touch was made at the place of an earlier one.
bool repeats_another(std::span<const Touch> touches);

}  // namespace cellcal::calib
