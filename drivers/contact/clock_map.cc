#include "drivers/contact/clock_map.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "drivers/median.h"

namespace cellcal::drivers {

namespace {

constexpr double kTickS = 1.0 / CTP_TICKS_PER_S;
/// Stamp jitter of the sensor (0.4 us measured) and of reading the host's clock.
constexpr double kStampSigmaS = 1e-6;
/// Samples within this excess of the shortest round trip are always used.
constexpr double kRoundTripSlackS = 20e-6;
/// Residuals beyond this many robust sigmas are outliers, except those below the floor.
constexpr double kOutlierSigmas = 4.0;
constexpr double kOutlierFloorS = 4e-6;
constexpr double kMadToSigma = 1.4826;
/// A sample whose distance from the map exceeds its own round trip by more than this contradicts
/// it.
constexpr double kJumpSlackS = 2e-3;
constexpr double kJumpSigmas = 6.0;
constexpr int kContradictionsAreJump = 3;
/// Maximum plausible delay of a PING in the sensor.
constexpr double kMaxTurnaroundS = 1.0;
/// Maximum plausible rate difference of two crystals.
constexpr double kMaxDrift = 1e-3;
constexpr std::size_t kMinForFit = 3;

}  // namespace

void ClockMap::reset() { *this = ClockMap(wire_s_); }

double ClockMap::x_of(std::uint32_t ticks) const {
  const auto since_last = static_cast<std::int32_t>(ticks - last_ticks_);
  return static_cast<double>(last_elapsed_ + since_last) * kTickS;
}

ClockMap::Sample ClockMap::add(TimePoint sent, TimePoint received, std::uint32_t t_rx,
                               std::uint32_t t_tx) {
  const double turnaround_s = static_cast<double>(t_tx - t_rx) * kTickS;
  const double round_trip_s = seconds(received - sent);
  if (turnaround_s > kMaxTurnaroundS || received < sent) return Sample::kOutlier;
  // An answer cannot precede its request, for any drift of the clocks.
  if (turnaround_s * (1.0 - kMaxDrift) > round_trip_s) return Sample::kOutlier;
  if (count_ == 0) {
    base_host_ = sent;
    last_ticks_ = t_rx;
    last_elapsed_ = 0;
  }
  Point p;
  p.round_trip_s = round_trip_s;
  p.excess_s = round_trip_s - turnaround_s - 2.0 * wire_s_;
  p.x_s = x_of(t_rx) + turnaround_s / 2.0;
  p.y_s = seconds(sent - base_host_) + p.round_trip_s / 2.0 - p.x_s;

  if (valid_) {
    const double allowed =
        std::max(0.0, p.excess_s) / 2.0 + kJumpSigmas * sigma_at_s(p.x_s) + kJumpSlackS;
    if (std::abs(p.y_s - deviation_s(p.x_s)) > allowed) {
      if (++contradictions_ < kContradictionsAreJump) return Sample::kOutlier;
      reset();
      return Sample::kJumped;
    }
    contradictions_ = 0;
  }
  last_elapsed_ += static_cast<std::int32_t>(t_rx - last_ticks_);
  last_ticks_ = t_rx;
  points_[next_] = p;
  next_ = (next_ + 1) % kWindow;
  count_ = std::min(count_ + 1, kWindow);
  round_trips();
  fit();
  return Sample::kTaken;
}

void ClockMap::round_trips() {
  std::array<double, kWindow> sorted{};
  for (std::size_t i = 0; i < count_; ++i) sorted[i] = points_[i].round_trip_s;
  std::sort(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(count_));
  rtt_min_s_ = sorted[0];
  rtt_p50_s_ = sorted[count_ / 2];
  rtt_p99_s_ = sorted[(count_ - 1) * 99 / 100];
}

void ClockMap::fit() {
  if (count_ < kMinSamples) return;
  std::array<double, kWindow> scratch{};
  double least = points_[0].excess_s;
  for (std::size_t i = 0; i < count_; ++i) {
    scratch[i] = points_[i].excess_s;
    least = std::min(least, points_[i].excess_s);
  }
  const double median = median_of(std::span(scratch).first(count_));
  const double limit = least + std::max(kRoundTripSlackS, median - least);

  std::array<bool, kWindow> use{};
  for (std::size_t i = 0; i < count_; ++i) use[i] = points_[i].excess_s <= limit;

  // Two passes: the second one without the outliers of the first.
  for (int pass = 0; pass < 2; ++pass) {
    double w_sum = 0.0, x_sum = 0.0, y_sum = 0.0;
    std::array<double, kWindow> weight{};
    std::size_t n = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      if (!use[i]) continue;
      const double half = (points_[i].excess_s - least) / 2.0;
      weight[i] = 1.0 / (kStampSigmaS * kStampSigmaS + half * half);
      w_sum += weight[i];
      x_sum += weight[i] * points_[i].x_s;
      y_sum += weight[i] * points_[i].y_s;
      ++n;
    }
    if (n < kMinForFit) return;
    mean_x_s_ = x_sum / w_sum;
    offset_s_ = y_sum / w_sum;
    double sxx = 0.0, sxy = 0.0;
    for (std::size_t i = 0; i < count_; ++i) {
      const double dx = points_[i].x_s - mean_x_s_;
      sxx += weight[i] * dx * dx;
      sxy += weight[i] * dx * (points_[i].y_s - offset_s_);
    }
    if (!(sxx > 0.0)) return;
    slope_ = sxy / sxx;

    double chi2 = 0.0;
    std::size_t k = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      if (!use[i]) continue;
      const double r = points_[i].y_s - deviation_s(points_[i].x_s);
      chi2 += weight[i] * r * r;
      scratch[k++] = std::abs(r);
    }
    // Scatter above the expected one widens the uncertainty; smaller scatter does not narrow it.
    const double scale = std::max(1.0, chi2 / static_cast<double>(n - 2));
    offset_var_s2_ = scale / w_sum;
    slope_var_ = scale / sxx;
    const double robust = kMadToSigma * median_of(std::span(scratch).first(k));
    const double bound = std::max(kOutlierFloorS, kOutlierSigmas * robust);
    for (std::size_t i = 0; i < count_; ++i) {
      use[i] = use[i] && std::abs(points_[i].y_s - deviation_s(points_[i].x_s)) <= bound;
    }
  }
  // Unknown division of the remaining excess: uniform within half of it on either side. A negative
  // excess is a line faster than its baud rate, in one of the two directions.
  systematic_s_ = std::abs(least) / (2.0 * std::sqrt(3.0));
  valid_ = true;
}

TimePoint ClockMap::to_host(std::uint32_t ticks) const {
  const double x = x_of(ticks);
  return base_host_ + from_seconds(x + deviation_s(x));
}

double ClockMap::sigma_at_s(double x_s) const {
  const double dx = x_s - mean_x_s_;
  return std::sqrt(offset_var_s2_ + slope_var_ * dx * dx + systematic_s_ * systematic_s_ +
                   kStampSigmaS * kStampSigmaS);
}

double ClockMap::sigma_s(std::uint32_t ticks) const { return sigma_at_s(x_of(ticks)); }

double ClockMap::sigma_s() const { return sigma_s(last_ticks_); }

double ClockMap::drift_ppm() const { return valid_ ? (1.0 / (1.0 + slope_) - 1.0) * 1e6 : 0.0; }

}  // namespace cellcal::drivers
