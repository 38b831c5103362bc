#include "sim/cell/contact_watch.h"

#include <algorithm>

namespace cellcal::sim {

void ContactWatch::look(drivers::TimePoint from, drivers::TimePoint to, const AnglesAt& angles) {
  if (!power_on_) power_on_ = from;
  const double warm =
      cell_.truth().warm_at(std::chrono::duration<double>(from - *power_on_).count());
  const std::vector<double> end = angles(to);
  const double gap = cell_.gap_m(end, warm);
  // The shaft can only be close if the tip is; saves the second check in transits.
  constexpr double kNearM = 0.2;
  if (gap < kNearM) {
    const bool inside = cell_.shaft_depth_m(end, warm) > 0.0;
    if (inside && !crashed_) ++crashes_;
    crashed_ = inside;
  }
  deepest_m_ = std::max(deepest_m_, -gap);
  const double closes_at = early_.closing_gap_m();
  const bool closed = gap <= closes_at;
  early_.look(gap, closed);
  if (closed == closed_) return;
  drivers::TimePoint before = from, after = to;
  constexpr drivers::Duration kResolution = std::chrono::nanoseconds(100);
  while (after - before > kResolution) {
    const drivers::TimePoint middle = before + (after - before) / 2;
    ((cell_.gap_m(angles(middle), warm) <= closes_at) == closed ? after : before) = middle;
  }
  closed_ = closed;
  on_edge_(after, closed);
}

}  // namespace cellcal::sim
