// Effects at an interruption and during recovery, until the links are verified.

#include "daemon/session/interruption.h"
#include "daemon/session/rules.h"

namespace cellcal::daemon::rules {

namespace {

void count_interruption(State& state, FailureKind kind, std::string detail,
                        drivers::Interruption by) {
  state.interrupted = Failure{kind, std::move(detail), by};
  state.interruptions.count(by);
  if (kind != FailureKind::kComputerBusy) return;
  state.busy_of_touch = repeats_of_touch(state) + 1;
  state.busy_touch = touch_number(state);
}

/// An unexplained silence is counted once its cause is known.
void take_interruption(State& state, const Event& event) {
  const drivers::Interruption by = interruption_by(state, event);
  state.unheard = by == drivers::Interruption::kUnheard;
  const FailureKind kind =
      failure_by(by, state.unheard ? FailureKind::kContactSilent : FailureKind::kRobotSilent);
  std::string detail = failure_detail(kind, state, event);
  state.late_then = state.links.delivery.late;
  state.silent_then = state.links.delivery.silent;
  if (state.unheard)
    state.interrupted = Failure{kind, std::move(detail), by};
  else
    count_interruption(state, kind, std::move(detail), by);
}

/// From the current position.
WayBack way_back(const State& state) {
  if (!state.one_by_one || state.plan->touches.empty()) return WayBack::kNone;
  switch (state.phase) {
    case Phase::kArmingFast:  // after noise it is near the surface
      return state.search_from_m > state.approach_m ? WayBack::kToSearch : WayBack::kNone;
    case Phase::kFastSearch:
    case Phase::kBackingOff:
    case Phase::kArmingSlow:
    case Phase::kSlowSearch:
      return WayBack::kToSearch;
    case Phase::kRecording:
    case Phase::kRetreat:
      return state.leads_on ? WayBack::kNone : WayBack::kToClear;
    case Phase::kReferencing:
    case Phase::kWatching:
      return state.way_back;
    case Phase::kFreeing:  // out of a contact, by the path alone or as a resumed session
      return state.way_back;
    default:
      return WayBack::kNone;
  }
}

void record_interruption(const State& state, Actions& actions) {
  RecordInterruption record{state.interruptions.total() - state.interruptions.of_computer(),
                            state.retries,
                            0,
                            0,
                            describe(*state.interrupted),
                            state.interrupted->by};
  if (state.interrupted->kind == FailureKind::kComputerBusy) {
    record.number = state.interruptions.of_computer();
    record.most = state.repeats.of_session;
    record.of_touch = repeats_of_touch(state);
    record.most_of_touch = state.repeats.of_touch;
  }
  actions.emplace_back(std::move(record));
}

void await_links(State& state, const Event& event) {
  state.busy_until.reset();
  if (state.interrupted->kind == FailureKind::kComputerBusy)
    state.busy_until = event.at + state.timeouts.busy;
  state.deadline = event.at + state.timeouts.recovering;
}

}  // namespace

void interrupt(State& state, const Event& event, Actions& actions) {
  // At the sphere being searched a contact is expected on the first move; elsewhere it is not.
  constexpr Phases kAtTheSphere{Phase::kFreeing,    Phase::kFastSearch, Phase::kBackingOff,
                                Phase::kSlowSearch, Phase::kRecording,  Phase::kRetreat};
  constexpr Phases kBeforeTheFirstMove{Phase::kReferencing, Phase::kRouting, Phase::kWatching};
  // A retreat that leads on to the next touch counts as at the sphere while in contact.
  const bool gone = state.leads_on && state.phase == Phase::kRetreat && !state.links.in_contact;
  if (!kBeforeTheFirstMove.has(state.phase)) state.resumed = kAtTheSphere.has(state.phase) && !gone;
  state.ahead = {};
  state.way_back = way_back(state);
  if (!state.pause_noted) note_pause(state, event, actions);
  if (kMoveResults.has(event.kind)) state.left_rad = event.at_rad;
  state.pause_noted = false;
  // Invalidates outstanding answers and held moves.
  state.held.reset();
  ++state.move_id;
  if (++state.arm_id == 0) state.arm_id = 1;
  ++state.route_id;
  if (!state.unheard) record_interruption(state, actions);
  actions.emplace_back(Disarm{});
  await_links(state, event);
}

/// A touch being written to the disk is counted first.
void note_pause(State& state, const Event& event, Actions&) {
  take_interruption(state, event);
  state.pause_noted = true;
  state.left_session = state.links.robot_session;
  state.left_rad = state.links.actual_rad;
}

void interrupt_behind_touch(State& state, const Event& event, Actions& actions) {
  interrupt(state, event, actions);
  ++state.done;
  state.failed_in_a_row = 0;
}

void watch_links(State& state, const Event& event, Actions& actions) {
  state.replies_before = event.links.late;
  state.late_before = event.links.delivery.late;
  state.interruptions_before = event.links.interruptions;
  if (!event.links.in_contact) actions.emplace_back(SelfTest{});
  state.deadline = event.at + state.timeouts.watching;
}

/// The cause of the silence is known: the data were sent in time.
void blame_computer(State& state, const Event& event, Actions& actions) {
  state.unheard = false;
  count_interruption(state, FailureKind::kComputerBusy, event.links.contact_words,
                     drivers::Interruption::kLateBytes);
  record_interruption(state, actions);
  await_links(state, event);
}

void blame_computer_and_watch(State& state, const Event& event, Actions& actions) {
  blame_computer(state, event, actions);
  watch_links(state, event, actions);
}

void blame_computer_and_identify(State& state, const Event& event, Actions& actions) {
  blame_computer(state, event, actions);
  close_and_identify(state, event, actions);
}

void wait_longer(State& state, const Event&, Actions&) { state.deadline = state.busy_until; }

void identify_behind_interruption(State& state, const Event& event, Actions& actions) {
  state.held.reset();
  take_interruption(state, event);
  record_interruption(state, actions);
  close_and_identify(state, event, actions);
}

}  // namespace cellcal::daemon::rules
