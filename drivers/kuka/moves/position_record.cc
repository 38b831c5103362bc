#include "drivers/kuka/moves/position_record.h"

#include <algorithm>
#include <cmath>

#include "drivers/units.h"

namespace cellcal::drivers {
namespace {

// Above the encoder noise of an arm at rest, below the motion of a moving one.
constexpr double kRestRad = 0.002 * kRadPerDeg;

}  // namespace

AxisDistance farthest_axis(const AxisAngles& a, const AxisAngles& b) {
  AxisDistance most;
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) {
    if (const double apart = std::abs(a[i] - b[i]); apart > most.rad) {
      most = {static_cast<std::uint8_t>(i), apart};
    }
  }
  return most;
}

PositionRecord::PositionRecord() : samples_(std::make_unique<Sample[]>(kDepth)) {}

void PositionRecord::push(TimePoint t_rx, std::uint32_t ipoc, const AxisAngles& actual_rad,
                          const AxisAngles& commanded_rad) {
  samples_[next_] = {t_rx, ipoc, actual_rad, commanded_rad};
  next_ = (next_ + 1) % kDepth;
  size_ = std::min(size_ + 1, kDepth);
}

void PositionRecord::set_commanded(const AxisAngles& commanded_rad) {
  if (size_ > 0) samples_[(next_ + kDepth - 1) % kDepth].commanded_rad = commanded_rad;
}

const PositionRecord::Sample& PositionRecord::newest(std::size_t back) const {
  return samples_[(next_ + 2 * kDepth - 1 - back) % kDepth];
}

AxisAngles PositionRecord::mean_actual_rad(std::size_t back, std::size_t count) const {
  AxisAngles mean = newest(back).actual_rad;
  count = std::min(count, size_ - back);
  for (std::size_t axis = 0; axis < mean.size(); ++axis) {
    double sum = 0.0;
    for (std::size_t i = 0; i < count; ++i) sum += newest(back + i).actual_rad[axis];
    mean[axis] = sum / static_cast<double>(count);
  }
  return mean;
}

bool PositionRecord::rests(std::size_t window) const {
  if (size_ < 2 * window) return false;
  return farthest_axis(mean_actual_rad(0, window), mean_actual_rad(window, window)).rad <= kRestRad;
}

PositionRecord::Range PositionRecord::commanded_range_rad(std::size_t axis,
                                                          std::size_t count) const {
  count = std::min(count, size_);
  Range range{newest().commanded_rad[axis], newest().commanded_rad[axis]};
  for (std::size_t i = 1; i < count; ++i) {
    const double commanded = newest(i).commanded_rad[axis];
    range.min = std::min(range.min, commanded);
    range.max = std::max(range.max, commanded);
  }
  return range;
}

std::optional<AxisAngles> PositionRecord::actual_at(TimePoint t, double seconds_per_ipoc) const {
  if (size_ < 2) return std::nullopt;
  const Sample& last = newest();
  // IPOC wraps: only differences are meaningful.
  const auto since_last_s = [&](const Sample& sample) {
    return static_cast<double>(static_cast<std::int32_t>(sample.ipoc - last.ipoc)) *
           seconds_per_ipoc;
  };
  double least_delay_s = 0.0;  // relative to the newest packet's
  for (std::size_t i = 1; i < size_; ++i) {
    const Sample& sample = newest(i);
    // A stamp beyond its successor's is damaged, and would shift the map for as long as it is kept.
    if (since_last_s(sample) > since_last_s(newest(i - 1))) continue;
    least_delay_s =
        std::min(least_delay_s, seconds(sample.t_rx - last.t_rx) - since_last_s(sample));
  }
  const double wanted_s = seconds(t - last.t_rx) - least_delay_s;
  if (wanted_s > 0.0 || wanted_s < since_last_s(newest(size_ - 1))) return std::nullopt;
  std::size_t before = 1;
  while (since_last_s(newest(before)) > wanted_s) ++before;
  const Sample& a = newest(before);
  const Sample& b = newest(before - 1);
  const double u = (wanted_s - since_last_s(a)) / (since_last_s(b) - since_last_s(a));
  AxisAngles angles = a.actual_rad;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    angles[i] += u * (b.actual_rad[i] - a.actual_rad[i]);
  }
  return angles;
}

}  // namespace cellcal::drivers
