#pragma once
// How evenly messages arrive: spread and longest of the times between them, over one session of the
// controller. A figure for people; nothing is decided by it on the cycle.

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
      // Welford's recurrence: no sums that lose their digits over days.
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
