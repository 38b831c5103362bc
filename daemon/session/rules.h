#pragma once
// Guards and effects named by the rows of the table. Effects see the old phase; step() sets the new one
// afterwards.

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

// Guards (guards.cc).
bool plan_differs(const State&, const Event&);
bool nothing_left(const State&, const Event&);
bool fresh_and_closed(const State&, const Event&);
/// A mode that requires a held enabling switch.
bool by_hand(drivers::OperatingMode mode);
bool operator_present(const State&, const Event&);
bool test_requested(const State&, const Event&);
bool test_requested_between(const State&, const Event&);
bool contact_faulty(const State&, const Event&);
bool robot_lost(const State&, const Event&);
bool links_ready(const State&, const Event&);
bool in_contact(const State&, const Event&);
bool closed_since(const State&, const Event&);
bool sensor_proven(const State&, const Event&);
bool sensor_proven_freed(const State&, const Event&);
bool sensor_proven_at_standoff(const State&, const Event&);
bool referenced(const State&, const Event&);
bool back_to_search(const State&, const Event&);
bool back_to_clear(const State&, const Event&);
bool more_waypoints(const State&, const Event&);
bool leads_on(const State&, const Event&);
bool more_waypoints_on(const State&, const Event&);
bool dry(const State&, const Event&);
bool dry_and_leads_on(const State&, const Event&);
bool next_is_known(const State&, const Event&);
bool more_way_home(const State&, const Event&);
bool no_way_home(const State&, const Event&);
bool not_found(const State&, const Event&);
bool not_found_at_home(const State&, const Event&);
bool not_found_after_last(const State&, const Event&);
bool not_self_tested(const State&, const Event&);
bool self_test_passed(const State&, const Event&);
bool too_early(const State&, const Event&);
bool contact_suffices(const State&, const Event&);
bool readings_agree(const State&, const Event&);
bool readings_left(const State&, const Event&);
bool revocations_left(const State&, const Event&);
bool had_first_contact(const State&, const Event&);
bool has_failed(const State&, const Event&);
bool may_miss(const State&, const Event&);
bool may_be_replaced(const State&, const Event&);
bool one_by_one(const State&, const Event&);
bool one_by_one_after_failure(const State&, const Event&);
bool sensor_proven_after_failure(const State&, const Event&);
bool sensor_proven_after_miss(const State&, const Event&);
bool contact_not_repeated(const State&, const Event&);
bool none_left(const State&, const Event&);
bool nothing_chosen(const State&, const Event&);
bool none_left_at_home(const State&, const Event&);
bool move_held(const State&, const Event&);
bool held_and_robot_lost(const State&, const Event&);
bool held_and_paused(const State&, const Event&);
bool held_and_paused_after_last(const State&, const Event&);
bool held_and_contact_faulty(const State&, const Event&);
bool interrupted(const State&, const Event&);
bool interrupted_after_last(const State&, const Event&);
bool computer_late(const State&, const Event&);
bool unheard(const State&, const Event&);
bool late_at_rest(const State&, const Event&);
bool late_and_may_go_on(const State&, const Event&);
bool held_and_late(const State&, const Event&);
bool held_and_late_after_last(const State&, const Event&);
bool unanswered_for_lateness(const State&, const Event&);
bool sensor_was_silent(const State&, const Event&);
bool computer_blamed(const State&, const Event&);
bool computer_blamed_and_back(const State&, const Event&);
bool late_here_after_last(const State&, const Event&);
bool robot_doubtful(const State&, const Event&);
bool robot_doubtful_meanwhile(const State&, const Event&);
bool late_again(const State&, const Event&);
bool only_sensor_missing(const State&, const Event&);
bool may_wait_longer(const State&, const Event&);
bool paused(const State&, const Event&);
bool paused_again(const State&, const Event&);
bool pause_noted(const State&, const Event&);
bool both_back(const State&, const Event&);
bool other_session(const State&, const Event&);
bool touched_meanwhile(const State&, const Event&);
bool both_proven(const State&, const Event&);
bool not_where_left(const State&, const Event&);
bool none_left_after_interruption(const State&, const Event&);

// Effects (rules.cc).
void plan_touches(State&, const Event&, Actions&);
void open_devices(State&, const Event&, Actions&);
void rereference(State&, const Event&, Actions&);
void find_route(State&, const Event&, Actions&);
void begin_back_to_search(State&, const Event&, Actions&);
void begin_back_to_clear(State&, const Event&, Actions&);
void begin_freeing(State&, const Event&, Actions&);
void prove_sensor(State&, const Event&, Actions&);
void doubt_sensor(State&, const Event&, Actions&);
void begin_transit(State&, const Event&, Actions&);
void next_waypoint(State&, const Event&, Actions&);
void arm_fast(State&, const Event&, Actions&);
void arm_slow(State&, const Event&, Actions&);
void self_test(State&, const Event&, Actions&);
void arm_again(State&, const Event&, Actions&);
void search_fast(State&, const Event&, Actions&);
void search_slow(State&, const Event&, Actions&);
void keep_first_and_back_off(State&, const Event&, Actions&);
void keep_reading_and_back_off(State&, const Event&, Actions&);
void back_off_from_noise(State&, const Event&, Actions&);
void record_first_contact(State&, const Event&, Actions&);
void record_touch(State&, const Event&, Actions&);
void leave(State&, const Event&, Actions&);
void leave_for_next(State&, const Event&, Actions&);
void pass_by(State&, const Event&, Actions&);
void keep_answer(State&, const Event&, Actions&);
void await_choice(State&, const Event&, Actions&);
void leave_empty_place(State&, const Event&, Actions&);
void give_touch_up(State&, const Event&, Actions&);
void choose_next(State&, const Event&, Actions&);
void interrupt(State&, const Event&, Actions&);
void note_pause(State&, const Event&, Actions&);
void interrupt_behind_touch(State&, const Event&, Actions&);
void watch_links(State&, const Event&, Actions&);
void blame_computer(State&, const Event&, Actions&);
void blame_computer_and_watch(State&, const Event&, Actions&);
void blame_computer_and_identify(State&, const Event&, Actions&);
void wait_longer(State&, const Event&, Actions&);
void identify_behind_interruption(State&, const Event&, Actions&);
void begin_way_home(State&, const Event&, Actions&);
void begin_way_out(State&, const Event&, Actions&);
void end_not_found(State&, const Event&, Actions&);
void end_touching(State&, const Event&, Actions&);
void go_home(State&, const Event&, Actions&);
void next_waypoint_home(State&, const Event&, Actions&);
void identify_at_once(State&, const Event&, Actions&);
void close_and_identify(State&, const Event&, Actions&);
void write_report(State&, const Event&, Actions&);
void record_good_end(State&, const Event&, Actions&);
void release_move(State&, const Event&, Actions&);
void stop(State&, const Event&, Actions&);
void close_and_end(State&, const Event&, Actions&);

/// Sets the failure, closes the devices and ends the session. The arm is at rest.
void fail(FailureKind kind, State&, const Event&, Actions&);
template <FailureKind kind>
void fail(State& state, const Event& event, Actions& actions) {
  fail(kind, state, event, actions);
}
/// Likewise, of the contact sensor's link: silent, or faulty.
void fail_of_sensor(State&, const Event&, Actions&);
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
void end_failed(State&, const Event&, Actions&);
/// The end could not be written to disk; only reported.
void note_journal_failure(State&, const Event&, Actions&);

/// A failure's sentence: what failed, where, and what to check.
calib::Phrase failure_detail(FailureKind kind, const State& state, const Event& event);
/// Likewise, with how to continue after the remedy.
calib::Phrase failure_words(FailureKind kind, const State& state, const Event& event);
/// An interruption that cannot be resumed.
calib::Phrase not_resumed_words(const Failure& failure, Setback why, const State& state);

}  // namespace cellcal::daemon::rules
