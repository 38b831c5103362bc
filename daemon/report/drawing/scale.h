#pragma once
// From values to pixels, and the round numbers that an axis shows.

#include <string>
#include <vector>

namespace cellcal::daemon::report {

/// Linear map of [from, to] onto [at_from, at_to].
struct Scale {
  double from = 0.0, to = 1.0;
  double at_from = 0.0, at_to = 1.0;

  double operator()(double value) const;
  /// Same, with the value first brought into [from, to].
  double clamped(double value) const;
  bool holds(double value) const;
};

/// Multiples of 1, 2 or 5 times a power of ten inside [from, to], about `wanted` of them and never
/// more than twice that. Empty where the range is empty or not finite.
std::vector<double> round_ticks(double from, double to, int wanted);

/// Tick labels with just the decimals that tell neighbours apart.
std::vector<std::string> tick_labels(const std::vector<double>& ticks);

/// The least of 1, 1.5, 2, 3, 4, 5, 6, 8 times a power of ten that is not below `value`; `fallback`
/// where the value is not finite or not positive.
double round_up(double value, double fallback);

}  // namespace cellcal::daemon::report
