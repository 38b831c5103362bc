#include "drivers/kuka/moves/move_queue.h"

namespace cellcal::drivers {

CoreResult refusal_of(const Move& move, const Cause& why, const AxisAngles& at_rad,
                      MoveOutcome outcome) {
  CoreResult refusal;
  refusal.id = move.id;
  refusal.outcome = outcome;
  refusal.cause = why;
  refusal.at_rad = at_rad;
  return refusal;
}

std::optional<Move> MoveQueue::next_waiting_move() {
  std::optional<Move> move = pending_;
  pending_.reset();
  return move;
}

void MoveQueue::add(const CoreResult& result) {
  if (results_.size() == results_.capacity()) results_.erase(results_.begin());
  results_.push_back(result);
}

std::optional<CoreResult> MoveQueue::next_result() {
  if (results_.empty()) return std::nullopt;
  const CoreResult oldest = results_.front();
  results_.erase(results_.begin());
  return oldest;
}

}  // namespace cellcal::drivers
