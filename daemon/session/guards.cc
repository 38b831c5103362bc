// Guards of the rows of the table.

#include <cmath>

#include "daemon/session/interruption.h"
#include "daemon/session/rules.h"

namespace cellcal::daemon::rules {

namespace {

/// The first move may lead out of a contact: the tip may still touch a sphere that an earlier session has
/// left. Only back along a search: the way is decided by the route.
bool may_leave_contact(const State& state, const Links& links) {
  return state.resumed ||
         (state.left && calib::way_out_of(*state.left, joint_vector(links.actual_rad), true));
}

/// A sensor in contact cannot pass its self-test before the arm has left, but it is operational.
bool contact_up(const State& state, const Links& links) {
  const bool touching =
      may_leave_contact(state, links) && links.in_contact && links.can_guard_retreat;
  return links.contact == drivers::ContactLink::kReady || touching;
}

/// This computer was late, or may have been; no other interruption.
bool is_lateness(const State& state) { return state.unheard || state.busy_until.has_value(); }

}  // namespace

drivers::Interruption interruption_by(const State& state, const Event& event) {
  using drivers::Interruption;
  if (event.kind() == EventKind::kArmRefused || event.kind() == EventKind::kDeadline)
    return Interruption::kLateBytes;
  if (event.kind() != EventKind::kLinks) return event.move().interruption;
  if (paused(state, event)) return state.links.interruption;
  if (!state.links.late_here()) return state.links.interruption;
  return late_at_rest(state, event) ? Interruption::kLateBytes : Interruption::kUnheard;
}

std::size_t touch_number(const State& state) {
  return state.done + static_cast<std::size_t>(state.failed_touches);
}

int repeats_of_touch(const State& state) {
  return state.busy_touch == touch_number(state) ? state.busy_of_touch : 0;
}

bool may_go_on(const State& state, FailureKind failure, drivers::Interruption by) {
  switch (goes_on(failure, by)) {
    case GoesOn::kNever: return false;
    case GoesOn::kRetries:
      return state.interruptions.total() - state.interruptions.of_computer() < state.retries;
    case GoesOn::kRepeats:
      return state.interruptions.of_computer() < state.repeats.of_session &&
             repeats_of_touch(state) < state.repeats.of_touch;
  }
  return false;
}

Missing missing(const State& state) {
  return {!state.links.robot_up(), !contact_up(state, state.links)};
}

bool plan_differs(const State& state, const Event& event) {
  return !state.expected_hash.empty() && state.expected_hash != event.get<Planned>().plan_hash;
}
bool nothing_left(const State& state, const Event& event) {
  if (state.one_by_one) return event.offer().progress.done;
  return event.offer().plan && state.done >= event.offer().plan->touches.size();
}
bool fresh_and_closed(const State& state, const Event&) {
  if (!state.links.in_contact || may_leave_contact(state, state.links)) return false;
  return !state.left || state.links.robot_up();  // the arm's position is unknown before
}
bool by_hand(drivers::OperatingMode mode) {
  return mode == drivers::OperatingMode::kT1 || mode == drivers::OperatingMode::kT2;
}
bool operator_present(const State& state, const Event& event) {
  constexpr int kFull = 100;
  const bool known = !robot_lost(state, event);
  return state.unattended && known &&
         (by_hand(state.links.mode) || state.links.override_percent.value_or(kFull) != kFull);
}
/// In unattended sessions only: the cell's own program runs the test after the session.
bool test_requested(const State& state, const Event&) {
  using drivers::ControllerRequest;
  const auto request = state.links.request;
  return state.unattended &&
         (request == ControllerRequest::kBrakeTest || request == ControllerRequest::kMasteringTest);
}
bool after_last(const State& state, const Event&) {
  if (state.deferred_failure) return false;
  if (state.phase == Phase::kReturning) return true;
  // With touches chosen one by one, a plan without touches is the way home; before the first choice
  // it is empty.
  return state.one_by_one ? state.plan->touches.empty() && !state.plan->home.empty()
                          : state.done >= state.plan->touches.size();
}
bool test_requested_between(const State& state, const Event& event) {
  return test_requested(state, event) && !after_last(state, event);
}
bool contact_faulty(const State& state, const Event&) {
  // While late bytes are waited for, they are not a fault of the sensor.
  const bool waits = kAwaitingPhases.has(state.phase) && state.links.late_here();
  if (state.links.contact == drivers::ContactLink::kFault) return !waits;
  const bool was_ready = state.phase != Phase::kConnecting;
  return was_ready && state.links.contact == drivers::ContactLink::kDown;
}
bool robot_lost(const State& state, const Event&) {
  return state.links.robot == drivers::RobotLink::kLost ||
         state.links.robot == drivers::RobotLink::kDown;
}
bool links_ready(const State& state, const Event&) {
  return state.links.robot_up() && contact_up(state, state.links);
}
bool in_contact(const State& state, const Event&) { return state.links.in_contact; }
bool closed_since(const State& state, const Event&) {
  return state.links.in_contact &&
         !(may_leave_contact(state, state.links) && state.routed_in_contact);
}
bool interrupted(const State& state, const Event& event) {
  const drivers::Interruption by = event.move().interruption;
  return may_go_on(state, failure_by(by, FailureKind::kRobotSilent), by);
}
bool computer_late(const State&, const Event& event) {
  return failure_by(event.move().interruption, FailureKind::kRobotSilent) ==
         FailureKind::kComputerBusy;
}
bool unheard(const State& state, const Event& event) {
  return event.move().interruption == drivers::Interruption::kUnheard &&
         may_go_on(state, FailureKind::kComputerBusy, drivers::Interruption::kLateBytes);
}
bool late_at_rest(const State& state, const Event&) {
  return state.links.fault == drivers::ContactFault::kDeliveredLate;
}
bool late_and_may_go_on(const State& state, const Event&) {
  return state.links.late_here() &&
         may_go_on(state, FailureKind::kComputerBusy, drivers::Interruption::kLateBytes);
}
/// Each of these refusals can result from a late answer alone, with no contact at the tip.
bool unanswered_for_lateness(const State& state, const Event& event) {
  using drivers::ArmRefusal;
  const ArmRefusal refusal = event.get<ArmAnswer>().refusal;
  const bool by_the_line =
      event.kind() == EventKind::kDeadline || refusal == ArmRefusal::kNoAnswer ||
      refusal == ArmRefusal::kNotReady || refusal == ArmRefusal::kLinkLost ||
      refusal == ArmRefusal::kClockNotSynchronised || refusal == ArmRefusal::kSelfTestOld;
  return by_the_line && state.links.delivery.late != state.late_before &&
         may_go_on(state, FailureKind::kComputerBusy, drivers::Interruption::kLateBytes);
}
bool sensor_was_silent(const State& state, const Event&) {
  return is_lateness(state) && state.links.delivery.silent != state.silent_then;
}
bool computer_blamed(const State& state, const Event&) {
  return state.unheard && state.links.delivery.late != state.late_then;
}
bool computer_blamed_and_back(const State& state, const Event& event) {
  return computer_blamed(state, event) && links_ready(state, event) && !state.links.unsettled;
}
bool robot_doubtful(const State& state, const Event& event) {
  return robot_lost(state, event) || state.links.needs_operator;
}
/// While only sensor data or replies were late, the robot's link has no reason to be doubtful.
bool robot_doubtful_meanwhile(const State& state, const Event& event) {
  // A thread that did not run loses its link by that alone; the link has to recover within the limit.
  const bool by_itself = state.links.interruption == drivers::Interruption::kLateReplies &&
                         !state.links.needs_operator;
  return is_lateness(state) && robot_doubtful(state, event) && !by_itself && !paused(state, event);
}
bool late_again(const State& state, const Event& event) {
  const Links& links = state.links;
  const bool late = links.delivery.late != state.late_before || links.late != state.replies_before;
  return late && may_wait_longer(state, event);
}
bool only_sensor_missing(const State& state, const Event& event) {
  return may_wait_longer(state, event) && state.links.robot_up();
}
bool may_wait_longer(const State& state, const Event& event) {
  return state.busy_until && event.at < *state.busy_until;
}
bool paused(const State& state, const Event&) {
  const Links& links = state.links;
  return links.robot != drivers::RobotLink::kReady &&
         may_go_on(state, failure_by(links.interruption, FailureKind::kRobotSilent),
                   links.interruption);
}
bool paused_again(const State& state, const Event& event) {
  return state.links.interruptions != state.interruptions_before && paused(state, event);
}
bool pause_noted(const State& state, const Event&) { return state.pause_noted; }
bool both_back(const State& state, const Event& event) {
  return links_ready(state, event) && !state.links.unsettled && !state.unheard;
}
bool other_session(const State& state, const Event&) {
  return state.links.robot != drivers::RobotLink::kLost &&
         state.links.robot_session != state.left_session;
}
bool touched_meanwhile(const State& state, const Event&) {
  return state.links.in_contact && !state.resumed;
}
bool both_proven(const State& state, const Event&) {
  const Links& links = state.links;
  const bool sound = links.late == state.replies_before &&
                     links.interruptions == state.interruptions_before &&
                     links.delivery.late == state.late_before;
  return links.robot_up() && contact_up(state, links) && sound && links.clock_ok &&
         (links.self_test_ok || links.in_contact);
}
bool not_where_left(const State& state, const Event& event) {
  if (!referenced(state, event) || !state.interrupted) return false;
  const drivers::AxisAngles& at = state.links.actual_rad;
  if (at.size() != state.left_rad.size()) return true;
  for (std::size_t i = 0; i < at.size(); ++i) {
    if (!(std::abs(at[i] - state.left_rad[i]) <= kLeftThereRad)) return true;
  }
  return false;
}
bool none_left_after_interruption(const State& state, const Event& event) {
  const bool planned_made =
      !state.one_by_one && state.plan && state.done >= state.plan->touches.size();
  return state.interruptions.total() > 0 &&
         (planned_made || (state.one_by_one && none_left(state, event)));
}
bool sensor_proven(const State& state, const Event&) {
  return state.links.ready() && state.links.self_test_ok && !state.links.in_contact;
}
bool sensor_proven_freed(const State& state, const Event& event) {
  return sensor_proven(state, event) && !state.touch_failed && !state.missed;
}
bool sensor_proven_at_standoff(const State& state, const Event& event) {
  return sensor_proven_freed(state, event) && !more_waypoints(state, event);
}
bool referenced(const State& state, const Event&) {
  return state.links.robot == drivers::RobotLink::kReady;
}
bool back_to_search(const State& state, const Event& event) {
  return referenced(state, event) && state.interrupted &&
         state.resume_path == ResumePath::kToSearch;
}
bool back_to_clear(const State& state, const Event& event) {
  return referenced(state, event) && state.interrupted && state.resume_path == ResumePath::kToClear;
}
bool more_waypoints(const State& state, const Event&) {
  return state.waypoint + 1 < waypoint_count(state);
}
bool leads_on(const State& state, const Event&) { return state.leads_on; }
bool dry(const State& state, const Event&) { return state.dry; }
bool next_is_known(const State& state, const Event&) {
  return !state.one_by_one && state.done + 1 < state.plan->touches.size();
}
bool more_way_home(const State& state, const Event&) {
  return state.waypoint + 1 < state.plan->home.size();
}
bool no_way_home(const State& state, const Event&) { return state.plan->home.empty(); }
bool not_self_tested(const State& state, const Event&) { return !state.self_tested; }
bool self_test_passed(const State& state, const Event&) {
  return !state.arm_pending && state.links.self_test_ok && state.links.ready();
}
bool too_early(const State& state, const Event& event) {
  // True also for NaN.
  return !(reading_of(state, event, false).along_m >= state.policy.earliest_m);
}
bool contact_suffices(const State& state, const Event& event) {
  const int every = state.policy.confirm_every;
  if (every <= 1 || state.done % static_cast<std::size_t>(every) == 0) return false;
  if (!was_met(state) || state.revoked > 0) return false;
  return event.move().latch &&
         !is_surprising(reading_of(state, event, false), expected_contact(state), state.policy);
}
bool readings_agree(const State& state, const Event& event) {
  return event.move().latch && find_agreement(with_new(state, event), state.policy).has_value();
}
bool readings_left(const State& state, const Event& event) {
  return event.move().latch && static_cast<int>(state.slow.size()) + 1 < state.policy.max_readings;
}
bool revocations_left(const State& state, const Event&) {
  return state.revoked < state.policy.max_revoked;
}
bool had_first_contact(const State& state, const Event&) { return state.first.has_value(); }
bool has_failed(const State& state, const Event&) { return state.failure.has_value(); }
bool may_miss(const State& state, const Event&) { return state.planned().may_miss; }
bool may_be_replaced(const State& state, const Event&) {
  return state.one_by_one && state.failed_in_a_row < state.policy.max_failed_in_a_row &&
         state.failed_touches < state.policy.max_failed;
}
bool one_by_one(const State& state, const Event&) { return state.one_by_one; }
bool one_by_one_after_failure(const State& state, const Event&) {
  return state.one_by_one && state.touch_failed.has_value();
}
bool sensor_proven_after_failure(const State& state, const Event& event) {
  return one_by_one_after_failure(state, event) && sensor_proven(state, event);
}
bool sensor_proven_after_miss(const State& state, const Event& event) {
  return state.missed && sensor_proven(state, event);
}
bool not_found(const State&, const Event& event) { return event.routed().not_found; }
bool not_found_after_last(const State& state, const Event&) {
  return state.deferred_failure.has_value();
}
bool none_left(const State&, const Event& event) { return event.offer().plan->touches.empty(); }
bool no_way_on(const State&, const Event& event) { return event.offer().plan->home.empty(); }

bool move_held(const State& state, const Event&) { return state.held.has_value(); }

}  // namespace cellcal::daemon::rules
