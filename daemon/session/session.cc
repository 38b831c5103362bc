#include "daemon/session/session.h"

#include "daemon/session/rules.h"

namespace cellcal::daemon {

namespace {

void note(State& state, const Event& event) {
  if (event.kind == EventKind::kLinks) state.links = event.links;
  if (event.kind == EventKind::kAssessed) {
    state.residual_m = event.residual_m;
    state.assessed = event.assessed;
    if (event.expected) state.expected = event.expected;
  }
}

/// Unlisted event: the arm is stopped where it can be moving, and the session fails with the name of the
/// pair.
void fail_safe(State& state, const Event& event, Actions& actions) {
  const bool may_move = kMovingPhases.has(state.phase) && !kMoveResults.has(event.kind);
  if (may_move) {
    rules::fail_and_stop(FailureKind::kUnexpectedEvent, state, event, actions);
    state.phase = Phase::kStopping;
    return;
  }
  actions.emplace_back(StopArm{});
  rules::fail(FailureKind::kUnexpectedEvent, state, event, actions);
  state.phase = Phase::kFailed;
}

}  // namespace

bool is_stale(const State& state, const Event& event) {
  if (kMoveResults.has(event.kind)) return event.move_id != state.move_id;
  if (event.kind == EventKind::kJournalSound)
    return !state.held || event.move_id != state.held->move.id;
  const bool arming = event.kind == EventKind::kArmed || event.kind == EventKind::kArmRefused;
  if (arming) return event.arm_id != state.arm_id;
  const bool answer = event.kind == EventKind::kRouted || event.kind == EventKind::kWorkFailed;
  return answer && event.route_id != 0 && event.route_id != state.route_id;
}

const Transition* find_row(const State& state, const Event& event) {
  for (const Transition& row : transition_table()) {
    if (!row.from.has(state.phase) || !row.on.has(event.kind)) continue;
    if (row.when == nullptr || row.when(state, event)) return &row;
  }
  return nullptr;
}

Step step(State state, const Event& event) {
  Step result{std::move(state), {}};
  if (is_stale(result.state, event)) return result;
  note(result.state, event);
  const Transition* row = find_row(result.state, event);
  if (row == nullptr) {
    result.state.deadline.reset();
    fail_safe(result.state, event, result.actions);
    return result;
  }
  if (row->to) result.state.deadline.reset();
  if (row->then != nullptr) row->then(result.state, event, result.actions);
  if (row->to) result.state.phase = *row->to;
  return result;
}

}  // namespace cellcal::daemon
