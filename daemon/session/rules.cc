#include "daemon/session/rules.h"

#include <algorithm>
#include <cmath>

#include "calib/model/units.h"
#include "daemon/session/interruption.h"

namespace cellcal::daemon::rules {

namespace {

/// Waypoints before the transit: those to where the arm waits, and the positioner's turn.
std::size_t before_transit(const calib::PlannedTouch& planned) {
  return planned.wait.empty() ? 0 : planned.wait.size() + 1;
}

using drivers::MoveKind;

/// Cause of a silent robot, as reported by the move or, at rest, by the link; whether a silent sensor has lost
/// its port; or lateness of this computer.
drivers::Interruption behind(FailureKind kind, const State& state, const Event& event) {
  if (kind == FailureKind::kComputerBusy) return interruption_by(state, event);
  if (kind == FailureKind::kContactSilent)
    return state.links.contact == drivers::ContactLink::kDown
               ? drivers::Interruption::kOther
               : drivers::Interruption::kPacketsStopped;
  if (kind != FailureKind::kRobotSilent) return drivers::Interruption::kNone;
  return event.kind() == EventKind::kLinks ? state.links.interruption : event.move().interruption;
}

std::chrono::milliseconds milliseconds(double seconds) {
  return std::chrono::milliseconds(static_cast<std::int64_t>(std::ceil(seconds * calib::kMsPerS)));
}

std::chrono::milliseconds search_timeout(const State& state, double duration_s) {
  return milliseconds(duration_s / pace(state) * state.timeouts.search_factor) +
         state.timeouts.search_slack;
}

/// Every move waits for the disk, whatever was recorded before it, so that no case can be omitted.
void begin(State& state, const Event& event, Actions& actions, drivers::Move move,
           std::chrono::milliseconds timeout) {
  HeldMove& held = state.held.emplace();
  held.timeout = timeout;
  held.move = std::move(move);
  held.move.id = ++state.move_id;
  if (held.move.kind == MoveKind::kSearch) held.move.arm_id = state.arm_id;
  actions.emplace_back(CheckJournal{held.move.id});
  state.deadline = event.at + state.timeouts.recording;
}

/// Direct move, at a constant speed where its duration is given.
void begin(State& state, const Event& event, Actions& actions, MoveKind kind,
           drivers::AxisAngles target, std::optional<double> cruise_s = {}) {
  drivers::Move move;
  move.kind = kind;
  move.target_rad = std::move(target);
  move.cruise_s = cruise_s.value_or(0.0);
  begin(state, event, actions, std::move(move),
        cruise_s ? search_timeout(state, *cruise_s) : state.timeouts.waypoint);
}

/// Angles [rad] at waypoint `k` of the current transit.
drivers::AxisAngles waypoint(const State& state, std::size_t k) {
  const calib::PlannedTouch& planned = state.planned();
  if (k >= to_standoff(state)) return at_travel(planned, state.approach_m);
  if (k < planned.wait.size()) return axis_angles(planned.wait[k], planned.wait_rad);
  const std::size_t before = before_transit(planned);
  if (k < before) return axis_angles(planned.wait.back(), planned.positioner_rad);
  return axis_angles(planned.transit.empty() ? planned.standoff : planned.transit.at(k - before),
                     planned.positioner_rad);
}

/// The arm comes to rest before the positioner turns, and that before the arm goes on.
bool is_beside_turn(const calib::PlannedTouch& planned, std::size_t k) {
  const std::size_t before = before_transit(planned);
  return k + 2 == before || k + 1 == before;
}

/// Clear point of the current touch; after the last one of a plan, of that.
drivers::AxisAngles clear_point(const State& state) {
  const std::size_t last = state.plan->touches.size() - 1;
  const calib::PlannedTouch& touch = state.plan->touches.at(std::min(state.current_index(), last));
  return axis_angles(touch.clear, touch.positioner_rad);
}

/// Waypoint of the way home, during which the positioner is at rest.
drivers::AxisAngles way_home(const State& state, std::size_t k) {
  const calib::Plan& plan = *state.plan;
  return axis_angles(plan.home.at(k),
                     plan.touches.empty() ? plan.home_rad : plan.touches.back().positioner_rad);
}

drivers::Via via(const drivers::AxisAngles& at_rad, const calib::Corner& corner) {
  return {at_rad, corner.in_share, corner.out_share};
}

/// Appends the waypoints from `state.waypoint` on to `move`, up to the stand-off or the capacity of one move,
/// without a stop.
void go_on(State& state, const Event& event, Actions& actions, drivers::Move move) {
  const calib::PlannedTouch& planned = state.planned();
  const std::vector<calib::Corner>& corners = planned.corners;
  const std::size_t before = before_transit(planned);
  std::size_t& k = state.waypoint;
  for (; k + 1 < waypoint_count(state) && move.via.size() < drivers::kMaxVias; ++k) {
    if (is_beside_turn(planned, k)) break;
    const bool rounded = k >= before && k - before < corners.size();
    move.via.push_back(via(waypoint(state, k), rounded ? corners[k - before] : calib::Corner{}));
  }
  move.target_rad = waypoint(state, k);
  const auto moves = static_cast<int>(move.via.size()) + 1;
  begin(state, event, actions, std::move(move), moves * state.timeouts.waypoint);
}

void go_on_to_standoff(State& state, const Event& event, Actions& actions) {
  go_on(state, event, actions, {});
}

/// Start of the search for the current touch.
void decide_approach(State& state) {
  state.approach_m = approach_m(state.planned(), expected_contact(state), state.policy);
  state.search_from_m = state.approach_m;
}

void arm(State& state, const Event& event, Actions& actions, double speed_m_s) {
  state.late_before = state.links.delivery.late;
  const double search_s = next_search(state, speed_m_s).takes_s();
  if (search_s > kLongestSearchS) {
    state.deadline = event.at;  // refused at once
    return;
  }
  // One-shot arming must outlive the search that it guards; 0 is not a valid arming id.
  if (++state.arm_id == 0) state.arm_id = 1;
  constexpr double kMargin = 1.5;
  const double lifetime_s = std::min(kMargin * search_s + kSettlingS, kLongestArmingS);
  actions.emplace_back(ArmSensor{state.arm_id, milliseconds(lifetime_s)});
  state.arm_pending = true;
  state.deadline = event.at + state.timeouts.arming;
}

void search(State& state, const Event& event, Actions& actions, double speed_m_s) {
  const NextSearch next = next_search(state, speed_m_s);
  begin(state, event, actions, MoveKind::kSearch, at_travel(state.planned(), next.end_m),
        next.full_speed_s);
}

void back_off_from(State& state, const Event& event, Actions& actions, double along_m,
                   double back_m) {
  state.search_from_m = std::max(0.0, along_m - back_m);
  const double duration_s = back_m / state.policy.fast_m_s;
  begin(state, event, actions, MoveKind::kRetreat, at_travel(state.planned(), state.search_from_m),
        duration_s);
}

/// Start of the way back: at the contact, and never beyond the position where the arm came to rest, whatever
/// the latch reports. A wrong value must not lead farther in.
double contact_m(const State& state, const Reading& reading) {
  if (reading.settled_rad.empty()) return reading.along_m;
  return std::min(reading.along_m, travel_m(state.planned(), reading.settled_rad));
}

void record_reading(const State& state, const Reading& reading, Actions& actions) {
  const int number = static_cast<int>(state.slow.size()) + (reading.slow ? 1 : 0);
  actions.emplace_back(RecordReading{state.done, number, reading});
}

void record(State& state, const Event& event, Actions& actions, const Agreement& agreement,
            double speed_m_s) {
  calib::Touch touch = touch_of(state.planned(), agreement, speed_m_s * pace(state));
  touch.load = state.load;
  actions.emplace_back(RecordTouch{state.done, std::move(touch)});
  if (!was_met(state)) state.met.push_back(state.planned().target);
  state.deadline = event.at + state.timeouts.recording;
}

void forget_touch(State& state) {
  state.waypoint = 0;
  state.leads_on = false;
  state.approach_m = state.search_from_m = 0.0;
  state.first.reset();
  state.slow.clear();
  state.revoked = 0;
  state.missed = false;
  state.self_tested = false;
}

void accept(State& state, const Offer& offer) {
  state.plan = offer.plan;
  if (!state.plan->touches.empty()) state.deferred_failure.reset();  // found out anew
  state.progress = offer.progress;
  state.chosen_after = state.done;
  state.stage = offer.stage;
}

/// On disk before the first of its moves, as every record is.
void record_search(const Event& event, Actions& actions) {
  if (const auto& search = event.routed().search) actions.emplace_back(RecordSearch{search});
}

/// The final choice: no further touch, and the reason.
void apply_final_choice(State& state, const Event& event, Actions& actions) {
  accept(state, event.offer());
  actions.emplace_back(RecordPlan{state.plan_hash, state.total()});
}

void end_interruption(State& state) {
  state.interrupted.reset();
  state.busy_until.reset();
}

}  // namespace

std::size_t to_standoff(const State& state) {
  const calib::PlannedTouch& planned = state.planned();
  return before_transit(planned) + std::max<std::size_t>(1, planned.transit.size());
}

std::size_t waypoint_count(const State& state) {
  return to_standoff(state) + (state.approach_m > 0.0 ? 1 : 0);
}

void plan_touches(State& state, const Event& event, Actions& actions) {
  actions.emplace_back(MakePlan{});
  state.deadline = event.at + state.timeouts.planning;
}

void open_devices(State& state, const Event& event, Actions& actions) {
  accept(state, event.offer());
  state.plan_hash = event.get<Planned>().plan_hash;
  actions.emplace_back(RecordPlan{state.plan_hash, state.total()});
  actions.emplace_back(OpenDevices{});
  state.deadline = event.at + state.timeouts.connecting;
}

void rereference(State& state, const Event& event, Actions& actions) {
  actions.emplace_back(Rereference{});
  state.interruptions_before = state.links.interruptions;
  state.deadline = event.at + state.timeouts.referencing;
}

void find_route(State& state, const Event& event, Actions& actions) {
  state.routed_in_contact = state.links.in_contact;
  ++state.route_id;
  if (state.one_by_one)
    actions.emplace_back(
        ChooseTouch{state.touch_failed, state.links.in_contact, {}, state.route_id});
  else
    actions.emplace_back(FindRoute{state.done, state.links.in_contact, state.route_id});
  state.touch_failed.reset();
  state.resume_path = ResumePath::kNone;
  end_interruption(state);
  state.deadline = event.at + state.timeouts.planning;
}

void begin_back_to_search(State& state, const Event& event, Actions& actions) {
  end_interruption(state);
  forget_touch(state);
  decide_approach(state);
  state.waypoint = waypoint_count(state) - 1;
  begin(state, event, actions, MoveKind::kRetreat, waypoint(state, state.waypoint));
}

void begin_back_to_clear(State& state, const Event& event, Actions& actions) {
  end_interruption(state);
  state.leads_on = false;  // also where the retreat to this touch led on to it
  begin(state, event, actions, MoveKind::kRetreat, clear_point(state));
}

void begin_freeing(State& state, const Event& event, Actions& actions) {
  accept(state, event.offer());
  state.left.reset();
  record_search(event, actions);
  forget_touch(state);
  decide_approach(state);
  begin(state, event, actions, MoveKind::kRetreat, waypoint(state, 0));
}

void prove_sensor(State& state, const Event& event, Actions& actions) {
  actions.emplace_back(Disarm{});  // armed for a search that met nothing, it would not test itself
  actions.emplace_back(SelfTest{});
  state.deadline = event.at + state.timeouts.proving;
}

/// A defective sensor and one without contact report the same: the sensor is tested.
void doubt_sensor(State& state, const Event& event, Actions& actions) {
  state.missed = true;
  prove_sensor(state, event, actions);
}

void begin_transit(State& state, const Event& event, Actions& actions) {
  accept(state, event.offer());
  state.left.reset();
  record_search(event, actions);
  forget_touch(state);
  decide_approach(state);
  go_on_to_standoff(state, event, actions);
}

void next_waypoint(State& state, const Event& event, Actions& actions) {
  ++state.waypoint;
  go_on_to_standoff(state, event, actions);
}

void arm_fast(State& state, const Event& event, Actions& actions) {
  state.self_tested = false;
  arm(state, event, actions, fast_m_s(state));
}

void arm_slow(State& state, const Event& event, Actions& actions) {
  state.self_tested = false;
  arm(state, event, actions, state.policy.slow_m_s);
}

void self_test(State& state, const Event& event, Actions& actions) {
  state.arm_pending = false;
  state.self_tested = true;
  actions.emplace_back(SelfTest{});
  state.deadline = event.at + state.timeouts.arming;
}

void arm_again(State& state, const Event& event, Actions& actions) {
  arm(state, event, actions, armed_speed_m_s(state));
}

void search_fast(State& state, const Event& event, Actions& actions) {
  search(state, event, actions, fast_m_s(state));
}

void search_slow(State& state, const Event& event, Actions& actions) {
  search(state, event, actions, state.policy.slow_m_s);
}

void keep_first_and_back_off(State& state, const Event& event, Actions& actions) {
  state.first = reading_of(state, event, false);
  record_reading(state, *state.first, actions);
  back_off_from(state, event, actions, contact_m(state, *state.first), state.policy.back_off_m);
}

void keep_reading_and_back_off(State& state, const Event& event, Actions& actions) {
  const Reading reading = reading_of(state, event, true);
  record_reading(state, reading, actions);
  state.slow.push_back(reading);
  back_off_from(state, event, actions, contact_m(state, reading), state.policy.slow_back_off_m);
}

void back_off_from_noise(State& state, const Event& event, Actions& actions) {
  ++state.revoked;
  ++state.total_revoked;
  back_off_from(state, event, actions, travel_m(state.planned(), event.move().at_rad),
                state.policy.back_off_m);
}

void record_touch(State& state, const Event& event, Actions& actions) {
  const Reading reading = reading_of(state, event, true);
  record_reading(state, reading, actions);
  state.slow.push_back(reading);
  const std::optional<Agreement> agreement = find_agreement(state.slow, state.policy);
  record(state, event, actions, *agreement, state.policy.slow_m_s);
}

void record_first_contact(State& state, const Event& event, Actions& actions) {
  state.first = reading_of(state, event, false);
  record_reading(state, *state.first, actions);
  record(state, event, actions, {{*state.first}, 0.0}, fast_m_s(state));
}

void leave(State& state, const Event& event, Actions& actions) {
  // Computed while the arm retreats.
  actions.emplace_back(Assess{});
  const drivers::AxisAngles clear = clear_point(state);
  if (state.one_by_one) {
    actions.emplace_back(ChooseTouch{std::nullopt, false, clear, ++state.route_id});
    state.ahead = {true, nullptr};
  }
  begin(state, event, actions, MoveKind::kRetreat, clear);
  state.leads_on = false;
  ++state.done;
  state.failed_in_a_row = 0;
}

void leave_for_next(State& state, const Event& event, Actions& actions) {
  actions.emplace_back(Assess{});
  const drivers::AxisAngles clear = clear_point(state);
  ++state.done;
  forget_touch(state);
  decide_approach(state);
  state.leads_on = true;
  drivers::Move move;
  move.kind = MoveKind::kRetreat;
  move.via.push_back(via(clear, state.planned().leaving));
  go_on(state, event, actions, std::move(move));
}

/// Retreat without a touch (dry run): any contact on this path ends the session.
void pass_by(State& state, const Event& event, Actions& actions) {
  const drivers::AxisAngles clear = clear_point(state);
  const drivers::Via leaving = via(clear, state.planned().leaving);
  const bool last = !next_is_known(state, event);
  ++state.done;
  forget_touch(state);
  if (last) return begin(state, event, actions, MoveKind::kTransit, clear);
  state.leads_on = true;
  drivers::Move move;
  move.via.push_back(leaving);
  go_on(state, event, actions, std::move(move));
}

/// Retreats along the search line, as after any touch. The sphere is not at the searched position.
void leave_empty_place(State& state, const Event& event, Actions& actions) {
  begin(state, event, actions, MoveKind::kRetreat, clear_point(state));
  state.leads_on = false;
  state.touch_failed = calib::NotMade::kMissed;
}

void give_touch_up(State& state, const Event& event, Actions& actions) {
  leave_empty_place(state, event, actions);
  // After a first contact, a search without contact does not prove that nothing is there.
  if (event.kind() != EventKind::kArrived || state.first)
    state.touch_failed = calib::NotMade::kFailed;
  ++state.failed_in_a_row;
  ++state.failed_touches;
}

void keep_answer(State& state, const Event& event, Actions&) {
  state.ahead.answer = std::make_shared<const Event>(event);
}

void await_choice(State& state, const Event& event, Actions& actions) {
  if (!state.ahead.asked) return choose_next(state, event, actions);
  if (state.ahead.answer) actions.emplace_back(TakeAnswer{state.ahead.answer});
  state.ahead = {};
  forget_touch(state);
  state.deadline = event.at + state.timeouts.planning;
}

void choose_next(State& state, const Event& event, Actions& actions) {
  actions.emplace_back(ChooseTouch{state.touch_failed, false, {}, ++state.route_id});
  state.touch_failed.reset();
  forget_touch(state);
  state.deadline = event.at + state.timeouts.planning;
}

void begin_way_home(State& state, const Event& event, Actions& actions) {
  apply_final_choice(state, event, actions);
  record_search(event, actions);
  go_home(state, event, actions);
}

void begin_way_out(State& state, const Event& event, Actions& actions) {
  state.deferred_failure =
      Failure{FailureKind::kNotFound, failure_words(FailureKind::kNotFound, state, event)};
  begin_way_home(state, event, actions);
}

void end_touching(State& state, const Event& event, Actions& actions) {
  apply_final_choice(state, event, actions);
  close_and_identify(state, event, actions);
}

void go_home(State& state, const Event& event, Actions& actions) {
  forget_touch(state);
  begin(state, event, actions, MoveKind::kTransit, way_home(state, 0));
}

void next_waypoint_home(State& state, const Event& event, Actions& actions) {
  ++state.waypoint;
  begin(state, event, actions, MoveKind::kTransit, way_home(state, state.waypoint));
}

void identify_at_once(State& state, const Event& event, Actions& actions) {
  accept(state, event.offer());
  state.plan_hash = event.get<Planned>().plan_hash;
  close_and_identify(state, event, actions);
}

void close_and_identify(State& state, const Event& event, Actions& actions) {
  actions.emplace_back(CloseDevices{});
  actions.emplace_back(Identify{});
  state.deadline = event.at + state.timeouts.identifying;
}

void write_report(State& state, const Event& event, Actions& actions) {
  state.result = event.get<Identified>().result;
  actions.emplace_back(WriteReport{state.result});
  state.deadline = event.at + state.timeouts.reporting;
}

void record_good_end(State& state, const Event& event, Actions& actions) {
  actions.emplace_back(RecordEnd{Ending::kDone, "", {}, state.result});
  state.deadline = event.at + state.timeouts.recording;
}

void release_move(State& state, const Event& event, Actions& actions) {
  actions.emplace_back(BeginMove{std::move(state.held->move)});
  state.deadline = event.at + state.held->timeout;
  state.held.reset();
}

void stop(State& state, const Event& event, Actions& actions) {
  actions.emplace_back(StopArm{});
  state.deadline = event.at + state.timeouts.stopping;
}

void close_and_end(State& state, const Event& event, Actions& actions) {
  if (const auto why = state.aborted_for)
    state.failure = Failure{*why, failure_words(*why, state, event)};
  actions.emplace_back(CloseDevices{});
  actions.emplace_back(
      RecordEnd{Ending::kAborted, state.failure ? to_journal(*state.failure) : "", state.failure});
}

void fail(FailureKind kind, State& state, const Event& event, Actions& actions) {
  calib::Phrase detail = failure_words(kind, state, event);
  if (state.failure)
    detail = {"say.failure.before_that", {{"what", detail}, {"before", phrase(*state.failure)}}};
  state.failure = Failure{kind, std::move(detail), behind(kind, state, event)};
  end_failed(state, event, actions);
}

void fail_of_sensor(State& state, const Event& event, Actions& actions) {
  const bool silent = state.links.contact == drivers::ContactLink::kDown ||
                      state.links.fault == drivers::ContactFault::kSilent;
  fail(silent ? FailureKind::kContactSilent : FailureKind::kContactFault, state, event, actions);
}

void fail_and_stop(FailureKind kind, State& state, const Event& event, Actions& actions) {
  state.failure = Failure{kind, failure_words(kind, state, event), behind(kind, state, event)};
  stop(state, event, actions);
}

void fail_interrupted(Setback why, State& state, const Event& event, Actions& actions) {
  state.failure = state.interrupted.value_or(Failure{FailureKind::kRobotSilent, ""});
  state.failure->detail = not_resumed_words(*state.failure, why, state);
  actions.emplace_back(StopArm{});
  end_failed(state, event, actions);
}

void end_failed(State& state, const Event&, Actions& actions) {
  actions.emplace_back(CloseDevices{});
  actions.emplace_back(RecordEnd{
      Ending::kFailed, state.failure ? to_journal(*state.failure) : std::string(), state.failure});
}

void end_not_found(State& state, const Event& event, Actions& actions) {
  state.failure = state.deferred_failure;
  end_failed(state, event, actions);
}

void note_journal_failure(State& state, const Event& event, Actions&) {
  state.failure =
      Failure{FailureKind::kJournal, failure_words(FailureKind::kJournal, state, event)};
}

}  // namespace cellcal::daemon::rules
