#pragma once
// The single clock of all components: steady and injected, so that the emulated cell can run in
// virtual time.

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>

namespace cellcal::drivers {

using TimePoint = std::chrono::steady_clock::time_point;
using Duration = std::chrono::steady_clock::duration;

inline double seconds(Duration d) { return std::chrono::duration<double>(d).count(); }
inline Duration from_seconds(double s) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(s));
}

class Clock {
 public:
  virtual ~Clock() = default;
  virtual TimePoint now() const = 0;
  /// Returns when now() >= t. On a virtual clock it advances the emulated cell.
  virtual void sleep_until(TimePoint t) = 0;
};

/// The machine's steady clock.
Clock& steady_clock();

// Histogram of times with fixed bounds, and their sum: unlike quantiles it can be aggregated over sessions and
// computers. Plain values without allocation, for the cycle.

struct TimeHistogram {
  /// Replies are typically within the first ones, cycles are 4 and 12 ms, 25 ms of silence stop an arm.
  static constexpr std::array<double, 13> kBounds_s{
      50e-6, 100e-6, 200e-6, 300e-6, 500e-6, 1e-3, 2e-3, 4e-3, 8e-3, 12e-3, 25e-3, 50e-3, 100e-3};
  /// Counts up to this bound and above the preceding one; the last one: above all.
  std::array<std::uint64_t, kBounds_s.size() + 1> counts{};
  double sum_s = 0.0;

  static std::size_t bucket(double time_s) {
    return static_cast<std::size_t>(std::lower_bound(kBounds_s.begin(), kBounds_s.end(), time_s) -
                                    kBounds_s.begin());
  }
  void add(double time_s) {
    ++counts[bucket(time_s)];
    sum_s += std::max(0.0, time_s);
  }
};

}  // namespace cellcal::drivers
