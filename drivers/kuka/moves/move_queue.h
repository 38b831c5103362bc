#pragma once
// The pending move and the pending results, for the cores of both adapters. Never allocates, locks
// or throws.

#include <boost/container/static_vector.hpp>
#include <optional>

#include "drivers/kuka/moves/core_result.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

/// Result of a move that does not begin.
CoreResult refusal_of(const Move& move, const Cause& why, const AxisAngles& at_rad,
                      MoveOutcome outcome = MoveOutcome::kRefused);

class MoveQueue {
 public:
  bool waiting() const { return pending_.has_value(); }
  void wait(const Move& move) { pending_ = move; }
  /// Removes and returns the pending move.
  std::optional<Move> take_waiting();

  /// If results are not read, the oldest are overwritten.
  void add(const CoreResult& result);
  std::optional<CoreResult> take_result();

 private:
  static constexpr std::size_t kDepth = 16;

  std::optional<Move> pending_;
  boost::container::static_vector<CoreResult, kDepth> results_;
};

}  // namespace cellcal::drivers
