#pragma once
// Jitter of message arrivals: standard deviation and maximum of the intervals, over one session of
// the controller. For display only; no decision on the cycle uses it.

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "drivers/time.h"

namespace cellcal::drivers {

class ArrivalSpread {
 public:
  void reset() { *this = ArrivalSpread(); }

  void add(TimePoint t) {
    if (seen_) {
      const double between_s = std::chrono::duration<double>(t - last_).count();
      longest_s_ = std::max(longest_s_, between_s);
      // Welford's recurrence: no loss of precision over days.
      ++count_;
      const double off_s = between_s - mean_s_;
      mean_s_ += off_s / static_cast<double>(count_);
      squares_s2_ += off_s * (between_s - mean_s_);
    }
    seen_ = true;
    last_ = t;
  }

  /// 1 sigma [s]; 0 before the third message.
  double sigma_s() const {
    return count_ > 1 ? std::sqrt(squares_s2_ / static_cast<double>(count_ - 1)) : 0.0;
  }
  double longest_s() const { return longest_s_; }

 private:
  bool seen_ = false;
  TimePoint last_{};
  std::uint64_t count_ = 0;
  double mean_s_ = 0.0, squares_s2_ = 0.0, longest_s_ = 0.0;
};

}  // namespace cellcal::drivers
