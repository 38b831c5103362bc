#pragma once
// Bisection of an interval.

namespace cellcal::drivers {

/// `holds` is true from `from` up to some value towards `to`, and false beyond: returns that value,
/// on the side where it is true; `from` if it is true nowhere else.
template <typename Holds>
double last_where(double from, double to, Holds holds) {
  constexpr int kHalvings = 52;  // full precision of a double
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = from + (to - from) / 2;
    (holds(middle) ? from : to) = middle;
  }
  return from;
}

}  // namespace cellcal::drivers
