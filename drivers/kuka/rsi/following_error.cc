#include "drivers/kuka/rsi/following_error.h"

#include <algorithm>
#include <cmath>

#include "drivers/units.h"

namespace cellcal::drivers {
namespace {

// Windows of increasing length; the shortest one is used in which the command exceeds encoder noise
// (0.001 deg, 1 sigma: six sigmas of the difference of two means of four) and the coarsest
// transmitted rounding (0.001 deg); slow axes need a longer one.
constexpr double kWindowsS[] = {0.06, 0.12, 0.24};
constexpr double kLeastTravelRad = 0.006 * kRadPerDeg;
// Number of packets for a mean with that noise; fewer packets of a longer cycle need more travel.
constexpr double kQuietPackets = 3.0;
constexpr double kStandsShare = 0.25;

std::size_t packets(double duration_s, double cycle_s) {
  return static_cast<std::size_t>(std::ceil(duration_s / cycle_s));
}

bool far_off(const PositionRecord& record, const RsiConfig& config, std::size_t axis,
             double cycle_s) {
  const std::size_t window = packets(config.follow_window_s, cycle_s) + 1;
  const double tolerance_rad = config.follow_tolerance_deg * kRadPerDeg;
  const PositionRecord::Range range = record.commanded_range_rad(axis, window);
  const double actual = record.newest().actual_rad[axis];
  return actual < range.min - tolerance_rad || actual > range.max + tolerance_rad;
}

// Smallest commanded travel of one axis within `window` packets, over windows that end up to `lag`
// packets ago; 0 if not in one direction.
double least_commanded(const PositionRecord& record, std::size_t axis, std::size_t window,
                       std::size_t lag) {
  const auto travel = [&](std::size_t back) {
    return record.newest(back).commanded_rad[axis] -
           record.newest(back + window).commanded_rad[axis];
  };
  const double newest = travel(0);
  double least = std::abs(newest);
  for (std::size_t back = 1; back <= lag; ++back) {
    least = std::min(least, std::copysign(1.0, newest) * travel(back));
  }
  return newest < 0.0 ? std::min(0.0, -least) : std::max(0.0, least);
}

double mean_actual(const PositionRecord& record, std::size_t axis, std::size_t back,
                   std::size_t count) {
  double sum = 0.0;
  for (std::size_t i = 0; i < count; ++i) sum += record.newest(back + i).actual_rad[axis];
  return sum / static_cast<double>(count);
}

bool stands(const PositionRecord& record, const RsiConfig& config, std::size_t axis,
            double cycle_s) {
  const std::size_t lag = packets(config.longest_lag_s, cycle_s);
  for (const double window_s : kWindowsS) {
    const std::size_t window = packets(window_s, cycle_s);
    const std::size_t count = std::max<std::size_t>(1, window / 4);
    // The means extend back by `count` more packets.
    if (record.size() <= window + lag + count) return false;
    const double commanded = least_commanded(record, axis, window, lag + count);
    const double louder = std::sqrt(std::max(1.0, kQuietPackets / static_cast<double>(count)));
    if (std::abs(commanded) < louder * kLeastTravelRad) continue;
    const double moved =
        mean_actual(record, axis, 0, count) - mean_actual(record, axis, window, count);
    return moved / commanded < kStandsShare;
  }
  return false;
}

}  // namespace

std::optional<Cause> following_fault(const PositionRecord& record, const RsiConfig& config,
                                     double cycle_s) {
  const PositionRecord::Sample& newest = record.newest();
  for (std::size_t i = 0; i < newest.actual_rad.size(); ++i) {
    const auto axis = static_cast<std::uint8_t>(i);
    const double commanded_deg = newest.commanded_rad[i] * kDegPerRad;
    const double actual_deg = newest.actual_rad[i] * kDegPerRad;
    if (far_off(record, config, i, cycle_s)) {
      return cause::AxisNotFollowing{axis, commanded_deg, actual_deg};
    }
    if (stands(record, config, i, cycle_s)) {
      return cause::AxisStands{axis, commanded_deg, actual_deg};
    }
  }
  return std::nullopt;
}

}  // namespace cellcal::drivers
