#pragma once
// Guards and effects named by the rows of the table. Effects see the old phase; step() sets the new one
// afterwards.

#include <type_traits>

#include "daemon/session/session.h"

namespace cellcal::daemon::rules {

/// Links that are not up.
struct Missing {
  bool robot = false, contact = false;
};
Missing missing(const State&);

// Current touch, for guards and effects (current_touch.cc).

Reading reading_of(const State&, const Event&, bool slow);
/// Its slow readings, including the one of this event.
std::vector<Reading> with_new(const State&, const Event&);
calib::ExpectedContact expected_contact(const State&);
/// Number of waypoints to the end of the transit: the stand-off, or a point on the search line nearer to the
/// expected contact. 0 for a transit without waypoints, which leads there directly. Where the positioner
/// turns, those to where the arm waits come first, then the turn with the arm at rest.
std::size_t to_standoff(const State&);
std::size_t waypoint_count(const State&);
/// True if its target was touched before.
bool was_met(const State&);

/// Speed of its first search [m/s].
double fast_m_s(const State&);
/// Speed of the search that the sensor is being armed for [m/s].
double armed_speed_m_s(const State&);
/// Share of the requested speed that the controller's override leaves to a search or a back-off, in (0, 1].
double pace(const State&);
/// Its next search. After a first contact it ends shortly beyond it, so that a known obstacle is not driven through.
struct NextSearch {
  double end_m = 0.0, length_m = 0.0;
  double full_speed_s = 0.0;  ///< without an override
  double pace = 1.0;
  double takes_s() const { return full_speed_s / pace; }
};
NextSearch next_search(const State&, double speed_m_s);
/// Limit of the sensor, whose field for it has 16 bits.
inline constexpr double kLongestArmingS = 60.0;
/// From the arming to the begin of the search, and from its end to the arm's rest.
inline constexpr double kSettlingS = 2.0;
inline constexpr double kLongestSearchS = kLongestArmingS - kSettlingS;

/// Reason why a session does not continue by itself after a harmless interruption.
enum class Setback {
  kNotBack,       ///< a link has not come back in time
  kOtherSession,  ///< the controller started another session
  kAgain,         ///< links not sound for the whole watching time
  kMoved,         ///< the arm is at another position
  kRobotToo,  ///< this computer was late, and the controller's link or program has stopped as well
  kSensorSilent,  ///< the sensor sent nothing: this computer was not late
};

/// Cause of the interruption according to this event, whether or not the session may continue.
drivers::Interruption interruption_by(const State&, const Event&);
/// Changes with each touch that is made or given up.
std::size_t touch_number(const State&);
/// Repeats of the current touch caused by lateness of this computer.
int repeats_of_touch(const State&);
/// True if the session may continue by itself.
bool may_go_on(const State&, FailureKind, drivers::Interruption by);

/// A mode that requires a held enabling switch.
bool by_hand(drivers::OperatingMode mode);

/// Type of every guard, and of every effect.
using GuardFunction = std::remove_pointer_t<Guard>;
using EffectFunction = std::remove_pointer_t<Effect>;

// Guards (guards.cc).
GuardFunction plan_differs, nothing_left, fresh_and_closed, operator_present, test_requested,
    test_requested_between, contact_faulty, robot_lost, links_ready, in_contact, closed_since,
    sensor_proven, sensor_proven_freed, sensor_proven_at_standoff, sensor_proven_after_failure,
    sensor_proven_after_miss, referenced, back_to_search, back_to_clear;
GuardFunction more_waypoints, leads_on, dry, next_is_known, more_way_home, no_way_home, no_way_on,
    not_found, not_found_after_last, after_last;
GuardFunction not_self_tested, self_test_passed, too_early, contact_suffices, readings_agree,
    readings_left, revocations_left, had_first_contact, has_failed, may_miss, may_be_replaced,
    one_by_one, one_by_one_after_failure, none_left, move_held;
GuardFunction interrupted, computer_late, unheard, late_at_rest, late_and_may_go_on,
    unanswered_for_lateness, sensor_was_silent, computer_blamed, computer_blamed_and_back,
    robot_doubtful, robot_doubtful_meanwhile, late_again, only_sensor_missing, may_wait_longer,
    paused, paused_again, pause_noted, both_back, other_session, touched_meanwhile, both_proven,
    not_where_left, none_left_after_interruption;
/// True where all of them are.
template <Guard... guards>
bool all(const State& state, const Event& event) {
  return (guards(state, event) && ...);
}

// Effects (rules.cc, interruption.cc).
EffectFunction plan_touches, open_devices, rereference, find_route, begin_back_to_search,
    begin_back_to_clear, begin_freeing, prove_sensor, doubt_sensor, begin_transit, next_waypoint;
EffectFunction arm_fast, arm_slow, self_test, arm_again, search_fast, search_slow,
    keep_first_and_back_off, keep_reading_and_back_off, back_off_from_noise, record_first_contact,
    record_touch, leave, leave_for_next, pass_by, keep_answer, await_choice, leave_empty_place,
    give_touch_up, choose_next;
EffectFunction interrupt, note_pause, interrupt_behind_touch, watch_links, blame_computer,
    blame_computer_and_watch, blame_computer_and_identify, wait_longer,
    identify_behind_interruption;
EffectFunction begin_way_home, begin_way_out, end_not_found, end_touching, go_home,
    next_waypoint_home, identify_at_once, close_and_identify, write_report, record_good_end,
    release_move, stop, close_and_end;

/// Sets the failure, closes the devices and ends the session. The arm is at rest.
void fail(FailureKind kind, State&, const Event&, Actions&);
template <FailureKind kind>
void fail(State& state, const Event& event, Actions& actions) {
  fail(kind, state, event, actions);
}
/// Likewise, of the contact sensor's link: silent, or faulty.
EffectFunction fail_of_sensor;
/// Sets the failure and stops the arm; the session ends when the arm rests.
void fail_and_stop(FailureKind kind, State&, const Event&, Actions&);
template <FailureKind kind>
void fail_and_stop(State& state, const Event& event, Actions& actions) {
  fail_and_stop(kind, state, event, actions);
}
/// Ends an interrupted session that cannot continue by itself.
void fail_interrupted(Setback why, State&, const Event&, Actions&);
template <Setback why>
void fail_interrupted(State& state, const Event& event, Actions& actions) {
  fail_interrupted(why, state, event, actions);
}
/// Ends a session whose failure is already set.
EffectFunction end_failed;
/// The end could not be written to disk; only reported.
EffectFunction note_journal_failure;

/// A failure's sentence: what failed, where, and what to check.
calib::Phrase failure_detail(FailureKind kind, const State& state, const Event& event);
/// Likewise, with how to continue after the remedy.
calib::Phrase failure_words(FailureKind kind, const State& state, const Event& event);
/// An interruption that cannot be resumed.
calib::Phrase not_resumed_words(const Failure& failure, Setback why, const State& state);

}  // namespace cellcal::daemon::rules
