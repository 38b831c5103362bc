#pragma once
// The pending move and the pending results, for the cores of both adapters. Never allocates, locks
// or throws.

#include <algorithm>
#include <boost/container/static_vector.hpp>
#include <cmath>
#include <cstdint>
#include <optional>

#include "drivers/kuka/moves/cause.h"
#include "drivers/robot.h"
#include "drivers/time.h"

namespace cellcal::drivers {

class MoveQueue {
 public:
  bool waiting() const { return pending_.has_value(); }
  void wait(const Move& move) { pending_ = move; }
  /// Removes and returns the pending move.
  std::optional<Move> next_waiting_move();

  /// If results are not read, the oldest are overwritten.
  void add(const CoreResult& result);
  std::optional<CoreResult> next_result();

 private:
  static constexpr std::size_t kDepth = 16;

  std::optional<Move> pending_;
  boost::container::static_vector<CoreResult, kDepth> results_;
};

// Jitter of message arrivals: standard deviation and maximum of the intervals, over one session of
// the controller. For display only; no decision on the cycle uses it.

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
