#pragma once
// How long it is waited until a line that was lost is opened again.

#include <algorithm>
#include <chrono>
#include <random>

namespace cellcal::daemon::plant {

/// Twice as long each time, up to the longest, and each between half and one and a half of that: a broker that starts again is not met
/// by all cells at once.
class Backoff {
 public:
  Backoff(std::chrono::milliseconds first, std::chrono::milliseconds longest)
      : first_(first), longest_(longest) {}

  std::chrono::milliseconds next() {
    wait_ = std::clamp(wait_ * 2, first_, longest_);
    const double share = std::uniform_real_distribution<double>(0.5, 1.5)(chance_);
    return std::chrono::duration_cast<std::chrono::milliseconds>(wait_ * share);
  }
  /// The line was good for something.
  void reset() { wait_ = {}; }
  /// Trying at once is of no use.
  void exhaust() { wait_ = longest_; }

 private:
  std::chrono::milliseconds first_, longest_, wait_{0};
  std::minstd_rand chance_{std::random_device{}()};
};

}  // namespace cellcal::daemon::plant
