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

namespace {

/// Above the distance of any back-off, and below that of every path to another touch.
constexpr double kAwayM = 0.005;
/// Distance at which a new closing is drawn; above the range of the noise.
constexpr double kOpenM = 0.0003;
constexpr double kLargestSigma = 2.5;
constexpr double kLeastChipM = 0.0003, kMostChipM = 0.001;
/// Independent of the draws of the arm.
constexpr std::uint64_t kOwnDraws = 104729;

}  // namespace

EarlyContact::EarlyContact(const ContactScatter& scatter, std::uint64_t seed)
    : scatter_(scatter), random_(seed + kOwnDraws) {
  noise_m_ = noise();
}

double EarlyContact::noise() {
  if (!(scatter_.noise_m > 0.0)) return 0.0;
  return scatter_.noise_m * std::clamp(random_.normal(), -kLargestSigma, kLargestSigma);
}

void EarlyContact::begin_visit() {
  chip_m_ = 0.0;
  if (!(scatter_.bad_share > 0.0) || random_.uniform() >= scatter_.bad_share) return;
  chip_m_ = random_.uniform(kLeastChipM, kMostChipM);
  falls_off_ = random_.uniform() < 0.5;
}

void EarlyContact::look(double gap_m, bool closed) {
  touched_ = touched_ || closed;
  if (touched_ && !closed && gap_m - chip_m_ > kOpenM) {
    touched_ = false;
    noise_m_ = noise();
    if (falls_off_) chip_m_ = 0.0;
  }
  const bool near = gap_m < kAwayM;
  if (near_ && !near) begin_visit();  // for the next visit
  near_ = near;
}

}  // namespace cellcal::sim
