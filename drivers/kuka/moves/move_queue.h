#pragma once
// The pending move and the pending results, for the cores of both adapters. Never allocates, locks
// or throws.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>

#include "drivers/kuka/moves/cause.h"
#include "drivers/latest_value.h"
#include "drivers/robot.h"
#include "drivers/time.h"

namespace cellcal::drivers {

class MoveQueue {
 public:
  bool waiting() const { return pending_.has_value(); }
  void wait(const Move& move) { pending_ = move; }
  /// Removes and returns the pending move.
  std::optional<Move> next_waiting_move() { return std::exchange(pending_, std::nullopt); }

  void add(const CoreResult& result) { results_.push(result); }
  std::optional<CoreResult> next_result() { return results_.pop(); }

 private:
  static constexpr std::size_t kDepth = 16;

  std::optional<Move> pending_;
  FixedRing<CoreResult, kDepth> results_;
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

// Validation of a move before any motion.

/// Number of axes, finite values, axis limits, for each way-point and the target. A straight
/// joint-space line between two points within the limits stays within them, and so does a corner
/// within its triangle, so these points are sufficient.
std::optional<Cause> object_to(const Move& move, std::span<const AxisLimit> limits);

/// Additionally the limits of an axis correction, one per axis [deg], of a linear unit [mm]. `base_rad`: pose at
/// correction 0.
std::optional<Cause> object_to(const Move& move, std::span<const AxisLimit> limits,
                               std::span<const double> correction_limit_deg,
                               const AxisAngles& base_rad);

/// Throws ConfigError where a linear unit is not the first of seven axes or more. `wire`: "eki".
void check_linear_unit(const char* wire, std::span<const AxisLimit> limits);

/// An external axis that moves in a search or on the first leg of a retreat, which move the arm alone.
/// `at_rad`: where it begins; `tolerance_rad`: of rest.
std::optional<Cause> object_to_travel(const Move& move, std::span<const AxisLimit> limits,
                                      const AxisAngles& at_rad, double tolerance_rad);

/// Legs of a move: way-points, and the target last.
inline std::size_t leg_count(const Move& move) { return move.via.size() + 1; }
inline const AxisAngles& leg_target(const Move& move, std::size_t leg) {
  return leg < move.via.size() ? move.via[leg].at_rad : move.target_rad;
}
/// The cause, attributed to the end of that leg.
Cause of_leg(Cause cause, const Move& move, std::size_t leg);

}  // namespace cellcal::drivers
