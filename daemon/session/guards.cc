// What the rows of the table ask before they are taken.

#include <algorithm>
#include <cmath>

#include "daemon/session/interruption.h"
#include "daemon/session/rules.h"
#include "daemon/session/search_line.h"

namespace cellcal::daemon::rules {

namespace {

/// A sensor in contact cannot pass its self-test before the arm has left; it is alive all the same.
bool contact_up(const State& state, const Links& links) {
  const bool touching = state.resumed && links.in_contact && links.can_guard_retreat;
  return links.contact == drivers::ContactLink::kReady || touching;
}

/// All touches are made, and nothing is left to move for but the way home.
bool behind_last(const State& state) {
  const bool all = !state.one_by_one && state.done >= state.plan->touches.size();
  return all || state.phase == Phase::kReturning;
}

}  // namespace

Missing missing(const State& state) {
  return {!state.links.robot_up(), !contact_up(state, state.links)};
}

bool plan_differs(const State& state, const Event& event) {
  return !state.expected_hash.empty() && state.expected_hash != event.plan_hash;
}
bool nothing_left(const State& state, const Event& event) {
  if (state.one_by_one) return event.progress.done;
  return event.plan && state.done >= event.plan->touches.size();
}
bool fresh_and_closed(const State& state, const Event& event) {
  return !state.resumed && event.links.in_contact;
}
bool by_hand(drivers::OperatingMode mode) {
  return mode == drivers::OperatingMode::kT1 || mode == drivers::OperatingMode::kT2;
}
bool somebody_there(const State& state, const Event& event) {
  constexpr int kFull = 100;
  const bool known = !robot_lost(state, event);
  return state.unattended && known &&
         (by_hand(event.links.mode) || event.links.override_percent.value_or(kFull) != kFull);
}
bool contact_faulty(const State& state, const Event& event) {
  if (event.links.contact == drivers::ContactLink::kFault) return true;
  const bool was_ready = state.phase != Phase::kConnecting;
  return was_ready && event.links.contact == drivers::ContactLink::kDown;
}
bool robot_lost(const State&, const Event& event) {
  return event.links.robot == drivers::RobotLink::kLost ||
         event.links.robot == drivers::RobotLink::kDown;
}
bool links_ready(const State& state, const Event& event) {
  return event.links.robot_up() && contact_up(state, event.links);
}
bool in_contact(const State& state, const Event&) { return state.links.in_contact; }
bool closed_since(const State& state, const Event&) {
  return state.links.in_contact && !(state.resumed && state.routed_in_contact);
}
bool interrupted(const State& state, const Event& event) {
  return state.interruptions < state.retries &&
         is_harmless(FailureKind::kRobotSilent, event.interruption);
}
bool interrupted_behind_last(const State& state, const Event& event) {
  return interrupted(state, event) && behind_last(state);
}
bool paused(const State& state, const Event& event) {
  const Links& links = event.links;
  return links.robot != drivers::RobotLink::kReady && state.interruptions < state.retries &&
         is_harmless(FailureKind::kRobotSilent, links.interruption);
}
bool paused_again(const State& state, const Event& event) {
  return event.links.interruptions != state.interruptions_before && paused(state, event);
}
bool pause_noted(const State& state, const Event&) { return state.pause_noted; }
bool both_back(const State& state, const Event& event) {
  return links_ready(state, event) && !event.links.unsettled;
}
bool other_session(const State& state, const Event& event) {
  return event.links.robot != drivers::RobotLink::kLost &&
         event.links.robot_session != state.left_session;
}
bool touched_meanwhile(const State& state, const Event& event) {
  return event.links.in_contact && !state.resumed;
}
bool both_proven(const State& state, const Event&) {
  const Links& links = state.links;
  const bool sound =
      links.late == state.late_before && links.interruptions == state.interruptions_before;
  return links.robot_up() && contact_up(state, links) && sound &&
         (links.self_test_ok || links.in_contact);
}
bool not_where_left(const State& state, const Event& event) {
  if (!referenced(state, event) || !state.interrupted) return false;
  const drivers::AxisAngles& at = event.links.actual_rad;
  if (at.size() != state.left_rad.size()) return true;
  for (std::size_t i = 0; i < at.size(); ++i) {
    if (!(std::abs(at[i] - state.left_rad[i]) <= kLeftThereRad)) return true;
  }
  return false;
}
bool none_left_behind_interruption(const State& state, const Event& event) {
  return state.interruptions > 0 && nothing_chosen(state, event);
}
bool sensor_proven(const State&, const Event& event) {
  return event.links.ready() && !event.links.in_contact;
}
bool sensor_proven_freed(const State& state, const Event& event) {
  return sensor_proven(state, event) && !state.touch_failed && !state.missed;
}
bool sensor_proven_at_standoff(const State& state, const Event& event) {
  return sensor_proven_freed(state, event) && !more_waypoints(state, event);
}
bool referenced(const State&, const Event& event) {
  return event.links.robot == drivers::RobotLink::kReady;
}
bool more_waypoints(const State& state, const Event&) {
  return state.waypoint + 1 < waypoint_count(state);
}
bool leads_on(const State& state, const Event&) { return state.leads_on; }
bool more_waypoints_on(const State& state, const Event& event) {
  return state.leads_on && more_waypoints(state, event);
}
bool dry(const State& state, const Event&) { return state.dry; }
bool dry_and_leads_on(const State& state, const Event&) { return state.dry && state.leads_on; }
bool next_is_known(const State& state, const Event&) {
  return !state.one_by_one && state.done + 1 < state.plan->touches.size();
}
bool more_way_home(const State& state, const Event&) {
  return state.waypoint + 1 < state.plan->home.size();
}
bool no_way_home(const State& state, const Event&) { return state.plan->home.empty(); }
bool not_self_tested(const State& state, const Event&) { return !state.self_tested; }
bool self_test_passed(const State& state, const Event& event) {
  return !state.arm_pending && event.links.self_test_ok && event.links.ready();
}
bool too_early(const State& state, const Event& event) {
  return !(reading_of(state, event, false).along_m >= state.policy.earliest_m);  // also: no number
}
bool contact_suffices(const State& state, const Event& event) {
  const int every = state.policy.confirm_every;
  if (every <= 1 || state.done % static_cast<std::size_t>(every) == 0) return false;
  if (!was_met(state) || state.revoked > 0) return false;
  return event.latch &&
         !is_surprising(reading_of(state, event, false), expected_contact(state), state.policy);
}
bool readings_agree(const State& state, const Event& event) {
  return event.latch && find_agreement(with_new(state, event), state.policy).has_value();
}
bool readings_left(const State& state, const Event& event) {
  return event.latch && static_cast<int>(state.slow.size()) + 1 < state.policy.max_readings;
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
  return one_by_one_after_failure(state, event) && sensor_proven(state, event) &&
         event.links.self_test_ok;
}
bool sensor_proven_after_miss(const State& state, const Event& event) {
  return state.missed && sensor_proven(state, event) && event.links.self_test_ok;
}
bool missed_what_was_met(const State& state, const Event& event) {
  return sensor_proven_after_miss(state, event) && state.first.has_value();
}
bool none_left(const State&, const Event& event) { return event.plan->touches.empty(); }
bool nothing_chosen(const State& state, const Event& event) {
  return state.one_by_one && none_left(state, event);
}
bool none_left_at_home(const State& state, const Event& event) {
  return none_left(state, event) && event.plan->home.empty();
}

bool move_held(const State& state, const Event&) { return state.held.has_value(); }
bool held_and_robot_lost(const State& state, const Event& event) {
  return move_held(state, event) && robot_lost(state, event);
}
bool held_and_paused(const State& state, const Event& event) {
  return move_held(state, event) && paused(state, event);
}
bool held_and_paused_behind_last(const State& state, const Event& event) {
  return held_and_paused(state, event) && behind_last(state);
}
bool held_and_contact_faulty(const State& state, const Event& event) {
  return move_held(state, event) && contact_faulty(state, event);
}

}  // namespace cellcal::daemon::rules
