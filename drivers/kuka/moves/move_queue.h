#pragma once
// The move that waits to begin and the results that wait to be taken, for the cores of both
// adapters. Nothing here allocates, locks or throws.

#include <boost/container/static_vector.hpp>
#include <optional>

#include "drivers/kuka/moves/core_result.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

/// What a move comes to that does not begin.
CoreResult refusal_of(const Move& move, const Cause& why, const AxisAngles& at_rad,
                      MoveOutcome outcome = MoveOutcome::kRefused);

class MoveQueue {
 public:
  bool waiting() const { return pending_.has_value(); }
  void wait(const Move& move) { pending_ = move; }
  /// The move that waits, which then waits no longer.
  std::optional<Move> take_waiting();

  /// The oldest results give way to the newest where nobody takes them.
  void add(const CoreResult& result);
  std::optional<CoreResult> take_result();

 private:
  static constexpr std::size_t kDepth = 16;

  std::optional<Move> pending_;
  boost::container::static_vector<CoreResult, kDepth> results_;
};

}  // namespace cellcal::drivers
