// All transitions of a session. Rows are tried from the top; the first that matches is taken.

#include "daemon/session/session.h"

#include <array>

#include "daemon/session/rules.h"

namespace cellcal::daemon {

namespace {

void note(State& state, const Event& event) {
  if (const Links* links = std::get_if<Links>(&event.evidence)) state.links = *links;
  if (const Assessed* assessed = std::get_if<Assessed>(&event.evidence)) {
    state.residual_m = assessed->residual_m;
    state.assessed = assessed->assessed;
    if (assessed->expected) state.expected = assessed->expected;
  }
  if (const Aborted* aborted = std::get_if<Aborted>(&event.evidence)) {
    // A person's abort precedes.
    if (!aborted->why || state.phase != Phase::kStopping) state.aborted_for = aborted->why;
  }
}

/// Unlisted event: the arm is stopped where it can be moving, and the session fails with the name of the
/// pair.
void fail_safe(State& state, const Event& event, Actions& actions) {
  const bool may_move = kMovingPhases.has(state.phase) && !kMoveResults.has(event.kind());
  if (may_move) {
    rules::fail_and_stop(FailureKind::kUnexpectedEvent, state, event, actions);
    state.phase = Phase::kStopping;
    return;
  }
  actions.emplace_back(StopArm{});
  rules::fail(FailureKind::kUnexpectedEvent, state, event, actions);
  state.phase = Phase::kFailed;
}

struct Stale {
  const State& state;
  bool route(std::uint32_t id) const { return id != 0 && id != state.route_id; }
  bool operator()(const MoveEnded& move) const { return move.move_id != state.move_id; }
  bool operator()(const JournalSound& sound) const {
    return !state.held || sound.move_id != state.held->move.id;
  }
  bool operator()(const ArmAnswer& answer) const { return answer.arm_id != state.arm_id; }
  bool operator()(const Routed& routed) const { return route(routed.route_id); }
  bool operator()(const WorkFailed& failed) const { return route(failed.route_id); }
  bool operator()(const auto&) const { return false; }
};

using namespace rules;  // NOLINT: the table consists of their names
using enum Phase;
using E = EventKind;
using F = FailureKind;

constexpr Phases kArming{kArmingFast, kArmingSlow};
constexpr Phases kSearching{kFastSearch, kSlowSearch};
constexpr Phases kNotUnderWay = kFinalPhases | Phases{kIdle};
constexpr Phases kPausing{kRouting, kProving, kArmingFast, kArmingSlow, kChoosing};
constexpr Phases kInterrupted{kRecovering, kWatchingTheLinks};
/// Moves that a link can end without a fault of robot or sensor.
constexpr Events kInterrupting{E::kRobotSilent, E::kContactSilent, E::kRefused};
constexpr std::optional<Phase> kStay = std::nullopt;

// clang-format off
constexpr std::array kTable{
// before the first move
Transition{kIdle,          E::kRun,          nullptr, "",                                kPlanning,    plan_touches, "plan the touches from the stored files"},
Transition{kPlanning,      E::kPlanned,      plan_differs, "not the stored plan",        kFailed,      fail<F::kPlanChanged>, "refuse to mix two plans in one session"},
Transition{kPlanning,      E::kPlanned,      nothing_left, "all touches are on disk",    kIdentifying, identify_at_once, "identify without opening a device"},
Transition{kPlanning,      E::kPlanned,      nullptr, "",                                kConnecting,  open_devices, "record the plan's hash; open robot and contact sensor"},
Transition{kPlanning,      E::kWorkFailed,   nullptr, "",                                kFailed,      fail<F::kPlan>, "no plan"},
Transition{kConnecting,    E::kDeviceFailed, nullptr, "",                                kFailed,      fail<F::kDevice>, "missing device, taken port"},
Transition{Phases(kConnecting, kReferencing), E::kLinks, operator_present, "unattended, and mode T1, T2 or override", kFailed, fail<F::kAttended>, "a person works at the robot"},
Transition{kConnecting,    E::kLinks,        fresh_and_closed, "contact closed, not resumed", kFailed,  fail<F::kContactClosed>, "a short, or the tip touches something"},
Transition{kConnecting,    E::kLinks,        contact_faulty, "sensor faulty",            kFailed,      fail_of_sensor, "loop broken, self-test failed, wrong version"},
Transition{kConnecting,    E::kLinks,        test_requested, "unattended, and the controller asks for a test", kStay, nullptr, "wait until the cell's program has run it"},
Transition{kConnecting,    E::kLinks,        links_ready, "both ready",                  kReferencing, rereference, "take the arm's actual position as the starting point"},
Transition{kConnecting,    E::kDeadline,     test_requested, "the test was not run",      kFailed,      fail<F::kControllerTest>, "nothing has moved"},
Transition{kConnecting,    E::kDeadline,     nullptr, "",                                kFailed,      fail<F::kLinkNotReady>, "name the link and the cause"},
Transition{kReferencing,   E::kLinks,        not_where_left, "not where the arm was left", kFailed,  fail_interrupted<Setback::kMoved>, "it was moved"},
Transition{kReferencing,   E::kLinks,        back_to_search, "interrupted in the search", kFreeing,    begin_back_to_search, "back along the search line to where it began"},
Transition{kReferencing,   E::kLinks,        back_to_clear, "interrupted after the touch", kRetreat,  begin_back_to_clear, "on to the clear point"},
Transition{kReferencing,   E::kLinks,        referenced, "robot ready",                  kRouting,     find_route, "look for a clear way to the next touch"},
Transition{kReferencing,   E::kDeadline,     nullptr, "",                                kFailed,      fail<F::kLinkNotReady>, "say why"},
Transition{kRouting,       E::kRouted,       all<not_found, no_way_on>, "a sphere cannot be found", kFailed,      fail<F::kNotFound>, "no move leads out: it ends in place"},
Transition{kRouting,       E::kRouted,       not_found, "a sphere cannot be found",      kReturning,   begin_way_out, "out of where it may be, so that another session can begin"},
Transition{kRouting,       E::kRouted,       none_left_after_interruption, "none left, interrupted", kIdentifying, end_touching, "the arm stays where it is; close the devices; identify"},
Transition{kRouting,       E::kRouted,       all<one_by_one, none_left>, "no touch can be made",     kFailed,      fail<F::kPlan>, "nothing can be reached from here"},
Transition{kRouting,       E::kRouted,       closed_since, "contact closed meanwhile", kFailed,      fail<F::kContactClosed>, "the way begins free of contact"},
Transition{kRouting,       E::kRouted,       in_contact, "contact closed (resumed)",     kFreeing,     begin_freeing, "first waypoint, out of contact"},
Transition{kRouting,       E::kRouted,       nullptr, "",                                kTransit,     begin_transit, "first waypoint"},
Transition{kRouting,       E::kWorkFailed,   nullptr, "",                                kFailed,      fail<F::kPlan>, "no clear way: the operator has to jog the arm"},
Transition{kFreeing,       E::kArrived,      nullptr, "",                                kProving,     prove_sensor, "out of contact: self-test of the sensor"},
Transition{kProving,       E::kLinks,        all<sensor_proven_after_miss, had_first_contact>, "proven, and a fast search had met it", kFailed, fail<F::kReadingsDisagree>, "the slow search met nothing"},
Transition{kProving,       E::kLinks,        sensor_proven_after_miss, "proven, nothing was met", kFailed,  fail<F::kNoContact>, "end of travel without contact"},
Transition{kProving,       E::kLinks,        sensor_proven_after_failure, "proven, the touch had failed", kChoosing, choose_next, "choose another touch in its place"},
Transition{kProving,       E::kLinks,        sensor_proven_at_standoff, "proven, at the stand-off", kArmingFast, arm_fast, "arm the sensor"},
Transition{kProving,       E::kLinks,        sensor_proven_freed, "proven",                    kTransit,     next_waypoint, "next waypoint"},
Transition{kProving,       E::kDeadline,     nullptr, "",                                kFailed,      fail<F::kLinkNotReady>, "say why"},
// one touch
Transition{kTransit,       E::kArrived,      more_waypoints, "more waypoints",           kTransit,     next_waypoint, "next waypoint"},
Transition{kTransit,       E::kArrived,      dry, "dry run",                            kRetreat,     pass_by, "nothing is searched: over the clear point to the next stand-off"},
Transition{kTransit,       E::kArrived,      nullptr, "",                                kArmingFast,  arm_fast, "at the stand-off: arm the sensor"},
Transition{kArming,        Events(E::kArmRefused, E::kDeadline), unanswered_for_lateness, "this computer was late", kRecovering, interrupt, "at rest: wait for the links"},
Transition{kArming,        E::kArmRefused,   not_self_tested, "first refusal",           kStay,        self_test, "repeat the sensor's self-test"},
Transition{kArming,        E::kLinks,        self_test_passed, "self-test passed",       kStay,        arm_again, "arm again"},
Transition{kArming,        E::kArmRefused,   nullptr, "",                                kFailed,      fail<F::kArmRefused>, "the sensor's reason"},
Transition{kArming,        E::kDeadline,     nullptr, "",                                kFailed,      fail<F::kArmRefused>, "no answer"},
Transition{kArmingFast,    E::kArmed,        nullptr, "",                                kFastSearch,  search_fast, "search at the fast speed to the end of travel"},
Transition{kFastSearch,    E::kContact,      too_early, "before the plausible window",   kFailed,      fail<F::kContactTooEarly>, "the tip met something else"},
Transition{kFastSearch,    E::kContact,      contact_suffices, "as expected, and none to be confirmed", kRecording, record_first_contact, "touch to disk, arm still at the contact"},
Transition{kFastSearch,    E::kContact,      nullptr, "",                                kBackingOff,  keep_first_and_back_off, "first contact: back off along the line"},
Transition{kFastSearch,    E::kArrived,      may_miss, "looking for a sphere",         kRetreat,     leave_empty_place, "it is not there: leave to the clear point"},
Transition{kSearching,     E::kArrived,      may_be_replaced, "another may replace it",  kRetreat,     give_touch_up, "end of travel without contact: leave to the clear point"},
Transition{kSearching,     E::kArrived,      nullptr, "",                                kProving,     doubt_sensor, "end of travel without contact: self-test of the sensor first"},
Transition{kSearching,     E::kRevoked,      revocations_left, "noise, and tries left",  kBackingOff,  back_off_from_noise, "back off and search again"},
Transition{kSearching,     E::kRevoked,      may_be_replaced, "another may replace it",  kRetreat,     give_touch_up, "noise, again and again: leave to the clear point"},
Transition{kSearching,     E::kRevoked,      nullptr, "",                                kFailed,      fail<F::kTooManyRevoked>, "noise, again and again"},
Transition{kBackingOff,    E::kArrived,      had_first_contact, "first contact known",   kArmingSlow,  arm_slow, "arm the sensor again"},
Transition{kBackingOff,    E::kArrived,      nullptr, "",                                kArmingFast,  arm_fast, "arm the sensor again"},
Transition{kArmingSlow,    E::kArmed,        nullptr, "",                                kSlowSearch,  search_slow, "slow search"},
Transition{kSlowSearch,    E::kContact,      readings_agree, "enough readings agree",    kRecording,   record_touch, "touch to disk, arm still at the contact"},
Transition{kSlowSearch,    E::kContact,      readings_left, "readings left",             kBackingOff,  keep_reading_and_back_off, "keep the reading, back off, read again"},
Transition{kSlowSearch,    E::kContact,      may_be_replaced, "another may replace it",  kRetreat,     give_touch_up, "readings do not repeat: leave to the clear point"},
Transition{kSlowSearch,    E::kContact,      nullptr, "",                                kFailed,      fail<F::kReadingsDisagree>, "readings do not repeat"},
Transition{kRecording,     E::kLinks,        pause_noted, "interrupted meanwhile",       kStay,        nullptr, "the touch goes to the disk first"},
Transition{kRecording,     E::kLinks,        late_and_may_go_on, "this computer was late", kStay,      note_pause, "the touch goes to the disk first"},
Transition{kRecording,     E::kLinks,        paused, "harmless, and retries left",       kStay,        note_pause, "the touch goes to the disk first"},
Transition{kRecording,     E::kRecorded,     pause_noted, "interrupted meanwhile",       kRecovering,  interrupt_behind_touch, "at rest: wait for the link"},
Transition{kRecording,     E::kRecorded,     next_is_known, "the next is known",         kRetreat,     leave_for_next, "assess the touch; leave over the clear point to the next one"},
Transition{kRecording,     E::kRecorded,     nullptr, "",                                kRetreat,     leave, "assess the touch, choose the next; leave to the clear point"},
Transition{kRetreat,       E::kArrived,      test_requested_between, "unattended, and the controller asks for a test", kFailed, fail<F::kControllerTest>, "out of contact: leave the controller to its program; resumed later"},
Transition{kRetreat,       E::kArrived,      all<leads_on, more_waypoints>, "more waypoints",        kTransit,     next_waypoint, "the rest of the way"},
Transition{kRetreat,       E::kArrived,      all<dry, leads_on>, "dry run, at the next stand-off", kRetreat, pass_by, "over the clear point to the following one"},
Transition{kRetreat,       E::kArrived,      leads_on, "at the next touch",              kArmingFast,  arm_fast, "at the stand-off: arm the sensor"},
Transition{kRetreat,       Events(E::kRouted, E::kWorkFailed), nullptr, "",              kStay,        keep_answer, "the next touch is chosen: for when the arm has left"},
Transition{kRetreat,       E::kArrived,      one_by_one_after_failure, "the touch failed", kProving,   prove_sensor, "self-test of the sensor"},
Transition{kRetreat,       E::kArrived,      one_by_one, "touches chosen one by one",    kChoosing,    await_choice, "choose the next from the results so far"},
Transition{kRetreat,       E::kArrived,      no_way_home, "nothing planned after it",   kIdentifying, close_and_identify, "close the devices; identify"},
Transition{kRetreat,       E::kArrived,      nullptr, "",                                kReturning,   go_home, "back to the start"},
Transition{kChoosing,      E::kRouted,       all<not_found, no_way_on>, "a sphere cannot be found", kFailed,      fail<F::kNotFound>, "no move leads out: it ends in place"},
Transition{kChoosing,      E::kRouted,       not_found, "a sphere cannot be found",      kReturning,   begin_way_out, "out of where it may be, so that another session can begin"},
Transition{kChoosing,      E::kRouted,       all<none_left, no_way_on>, "none left",             kIdentifying, end_touching, "close the devices; identify"},
Transition{kChoosing,      E::kRouted,       none_left, "none left, or goal reached",    kReturning,   begin_way_home, "back to the start"},
Transition{kChoosing,      E::kRouted,       nullptr, "",                                kTransit,     begin_transit, "first waypoint to the chosen one"},
Transition{kChoosing,      E::kWorkFailed,   nullptr, "",                                kFailed,      fail<F::kPlan>, "nothing can be chosen"},
// after the last touch
Transition{kReturning,     E::kArrived,      more_way_home, "more waypoints",            kReturning,   next_waypoint_home, "next waypoint"},
Transition{kReturning,     E::kArrived,      not_found_after_last, "a sphere was not found",    kFailed,      end_not_found, "the arm is out"},
Transition{kReturning,     E::kArrived,      nullptr, "",                                kIdentifying, close_and_identify, "close the devices; identify"},
Transition{kIdentifying,   E::kIdentified,   nullptr, "",                                kReporting,   write_report, "write touches, calibration and report"},
Transition{kIdentifying,   E::kWorkFailed,   nullptr, "",                                kFailed,      fail<F::kIdentify>, "the touches stay in the journal"},
Transition{kReporting,     E::kReported,     nullptr, "",                                kStay,        record_good_end, "record the end"},
Transition{kReporting,     E::kRecorded,     nullptr, "",                                kDone,        nullptr, "the end is on disk"},
Transition{kReporting,     E::kWorkFailed,   nullptr, "",                                kFailed,      fail<F::kReport>, "the touches stay in the journal"},
// harmless interruptions (interruption.h): this computer was late, or the configuration allows sessions to
// continue
Transition{kMovingPhases,  kInterrupting,    all<interrupted, after_last>, "harmless, all touches made", kIdentifying, identify_behind_interruption, "the arm stays where it is; close the devices; identify"},
Transition{kMovingPhases,  kInterrupting,    interrupted, "harmless, and retries left",  kRecovering,  interrupt, "at rest: wait for the link"},
Transition{kMovingPhases,  kInterrupting,    unheard, "sensor silent, cause unknown", kRecovering, interrupt, "at rest: decided by its time stamps"},
Transition{kMovingPhases,  E::kLinks,        all<move_held, late_and_may_go_on, late_at_rest, after_last>, "not begun, late, all touches made", kIdentifying, identify_behind_interruption, "the arm stays where it is; close the devices; identify"},
Transition{kMovingPhases,  E::kLinks,        all<move_held, late_and_may_go_on>, "not begun, this computer late", kRecovering, interrupt, "at rest: wait for the links"},
Transition{kMovingPhases,  E::kLinks,        all<move_held, paused, after_last>, "not begun, all touches made", kIdentifying, identify_behind_interruption, "the arm stays where it is; close the devices; identify"},
Transition{kMovingPhases,  E::kLinks,        all<move_held, paused>, "not begun, harmless",     kRecovering,  interrupt, "at rest: wait for the link"},
Transition{kPausing | Phases{kReferencing}, E::kLinks, late_and_may_go_on, "this computer was late", kRecovering, interrupt, "at rest: wait for the links"},
Transition{kPausing,       E::kLinks,        paused, "harmless, and retries left",       kRecovering,  interrupt, "at rest: wait for the link"},
Transition{Phases(kReferencing, kWatchingTheLinks), E::kLinks, paused_again, "harmless, and retries left", kRecovering, interrupt, "at rest: wait for the link"},
Transition{kInterrupted,   E::kLinks,        other_session, "another session",           kFailed,      fail_interrupted<Setback::kOtherSession>, "the controller has stopped meanwhile"},
Transition{kInterrupted,   E::kLinks,        contact_faulty, "sensor faulty or lost",    kFailed,      fail_of_sensor, "sensor's words"},
Transition{kInterrupted,   E::kLinks,        touched_meanwhile, "contact where none was made", kFailed, fail<F::kUnexpectedContact>, "contact outside a search"},
Transition{kRecovering,    E::kLinks,        robot_doubtful_meanwhile, "robot lost, or stopped", kFailed, fail_interrupted<Setback::kRobotToo>, "not this computer alone"},
Transition{kInterrupted,   E::kLinks,        sensor_was_silent, "the sensor was silent itself", kFailed, fail_interrupted<Setback::kSensorSilent>, "no heartbeat of the sensor"},
Transition{kRecovering,    E::kLinks,        all<computer_blamed, after_last>, "sent in time, all touches made", kIdentifying, blame_computer_and_identify, "the arm stays where it is; close the devices; identify"},
Transition{kRecovering,    E::kLinks,        computer_blamed_and_back, "sent in time, both back", kWatchingTheLinks, blame_computer_and_watch, "observe them; self-test of the sensor"},
Transition{kRecovering,    E::kLinks,        computer_blamed, "sent in time, late here",  kStay,        blame_computer, "at rest: wait for the links"},
Transition{kRecovering,    E::kLinks,        both_back, "both back",                     kWatchingTheLinks, watch_links, "observe them; self-test of the sensor"},
Transition{kRecovering,    E::kDeadline,     only_sensor_missing, "this computer is still busy", kStay,     wait_longer, "a busy spell ends by itself"},
Transition{kRecovering,    E::kDeadline,     nullptr, "",                                kFailed,      fail_interrupted<Setback::kNotBack>, "requires an operator"},
Transition{kWatchingTheLinks, E::kLinks,        robot_doubtful, "robot lost, or stopped",   kFailed,      fail_interrupted<Setback::kAgain>, "not sound"},
Transition{kWatchingTheLinks, E::kLinks,        late_again, "late again",                   kStay,        watch_links, "observe them again; self-test of the sensor"},
Transition{kWatchingTheLinks, E::kDeadline,     both_proven, "both proven",                 kReferencing, rereference, "take the arm's actual position as the starting point"},
Transition{kWatchingTheLinks, E::kDeadline,     may_wait_longer, "this computer is still busy", kRecovering, wait_longer, "at rest: wait for the links"},
Transition{kWatchingTheLinks, E::kDeadline,     nullptr, "",                                kFailed,      fail_interrupted<Setback::kAgain>, "not sound"},
// a move waits until everything recorded before it is on disk; the arm rests meanwhile
Transition{kMovingPhases,  E::kJournalSound, nullptr, "",                                kStay,        release_move, "all is on disk: begin the move"},
Transition{kMovingPhases,  E::kAbort,        move_held, "move not begun",                kAborted,     close_and_end, "close the devices; record the end"},
Transition{kMovingPhases,  E::kLinks,        all<move_held, robot_lost>, "move not begun, robot lost", kFailed, fail<F::kRobotSilent>, "packets stopped"},
Transition{kMovingPhases,  E::kLinks,        all<move_held, contact_faulty>, "move not begun, sensor faulty", kFailed, fail_of_sensor, "sensor's words"},
Transition{kMovingPhases,  E::kDeadline,     move_held, "move not begun",                kFailed,      fail<F::kJournal>, "the disk does not answer: hold still"},
Transition{kRecording,     E::kDeadline,     nullptr, "",                                kFailed,      fail<F::kJournal>, "the disk does not answer: hold still"},
Transition{kMovingPhases,  E::kJournalFailed, move_held, "move not begun",               kFailed,      fail<F::kJournal>, "not on disk: hold still"},
Transition{kMovingPhases,  E::kJournalFailed, nullptr, "",                               kStopping,    fail_and_stop<F::kJournal>, "stop; not on disk"},
// events that stop a moving arm: the driver has brought it to rest and gives the cause
Transition{kMovingPhases,  E::kUnexpectedContact, nullptr, "",                           kFailed,      fail<F::kUnexpectedContact>, "contact outside a search"},
Transition{kMovingPhases,  E::kStillInContact, nullptr, "",                              kFailed,      fail<F::kStillInContact>, "contact did not open"},
Transition{kMovingPhases,  kInterrupting,    computer_late, "this computer was late",    kFailed,      fail<F::kComputerBusy>, "no repeat is left"},
Transition{kMovingPhases,  E::kContactSilent, nullptr, "",                               kFailed,      fail<F::kContactSilent>, "no heartbeat of the sensor"},
Transition{kMovingPhases,  E::kRobotSilent,  nullptr, "",                                kFailed,      fail<F::kRobotSilent>, "no packets of the controller"},
Transition{kMovingPhases,  E::kRefused,      nullptr, "",                                kFailed,      fail<F::kMoveRefused>, "move not begun"},
Transition{kMovingPhases,  E::kNotFollowing, nullptr, "",                                kFailed,      fail<F::kNotFollowing>, "drives off, or clamped"},
Transition{kMovingPhases,  E::kStopped,      nullptr, "",                                kFailed,      fail<F::kStoppedElsewhere>, "stopped by another party"},
Transition{kMovingPhases,  E::kDeadline,     nullptr, "",                                kStopping,    fail_and_stop<F::kTimeout>, "stop; the move takes longer than plausible"},
// events that end a session with the arm at rest
Transition{kStandingPhases, E::kLinks,       robot_lost, "robot lost",                   kFailed,      fail<F::kRobotSilent>, "packets stopped"},
Transition{kStandingPhases, E::kLinks,       late_at_rest, "this computer was late",     kFailed,      fail<F::kComputerBusy>, "no repeat is left"},
Transition{kStandingPhases, E::kLinks,       contact_faulty, "sensor faulty or lost",    kFailed,      fail_of_sensor, "sensor's words"},
Transition{kStandingPhases | kThinkingPhases, E::kDeadline, nullptr, "",                 kFailed,      fail<F::kTimeout>, "longer than plausible"},
Transition{kActivePhases,  E::kJournalFailed, nullptr, "",                               kFailed,      fail<F::kJournal>, "not on disk: hold still"},
Transition{kStandingPhases | kInterrupted, E::kDeviceFailed, nullptr, "",                               kFailed,      fail<F::kDevice>, "a device refused a call"},
Transition{kMovingPhases,  E::kDeviceFailed, nullptr, "",                                kStopping,    fail_and_stop<F::kDevice>, "stop; a device refused a call"},
// stopping and aborting
Transition{kMovingPhases,  E::kAbort,        nullptr, "",                                kStopping,    stop, "stop the arm"},
Transition{kStandingPhases | kThinkingPhases | kAwaitingPhases, E::kAbort, nullptr, "", kAborted,  close_and_end, "close the devices; record the end"},
Transition{kStopping,      kMoveResults,     has_failed, "because of a failure",         kFailed,      end_failed, "at rest: close the devices; record the end"},
Transition{kStopping,      kMoveResults,     nullptr, "",                                kAborted,     close_and_end, "at rest: close the devices; record the end"},
Transition{kStopping,      E::kDeadline,     nullptr, "",                                kFailed,      fail<F::kStopUnconfirmed>, "no sign of rest"},
Transition{kStopping,      Events(E::kRouted, E::kWorkFailed), nullptr, "",             kStay,        nullptr, "no further move: ignored"},
Transition{kStopping,      Events(E::kAbort, E::kJournalFailed), nullptr, "",            kStay,        nullptr, "already stopping"},
Transition{kAborted,       E::kJournalFailed, nullptr, "",                               kFailed,      note_journal_failure, "the end is not on disk"},
// events that only update known values
Transition{kActivePhases | Phases{kStopping}, E::kLinks, nullptr, "",                    kStay,        nullptr, "noted for messages; a moving arm's links are the driver's to judge"},
Transition{kActivePhases | Phases{kStopping}, E::kAssessed, nullptr, "",                 kStay,        nullptr, "noted for the progress line"},
Transition{kActivePhases | Phases{kStopping}, E::kRun, nullptr, "",                      kStay,        nullptr, "one session at a time"},
Transition{kNotUnderWay,   Events::all(),    nullptr, "",                                kStay,        nullptr, "nothing under way: late answers are dropped"},
};
// clang-format on

}  // namespace

bool is_stale(const State& state, const Event& event) {
  return std::visit(Stale{state}, event.evidence);
}

const Transition* find_row(const State& state, const Event& event) {
  for (const Transition& row : transition_table()) {
    if (!row.from.has(state.phase) || !row.on.has(event.kind())) continue;
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

std::span<const Transition> transition_table() { return kTable; }

}  // namespace cellcal::daemon
