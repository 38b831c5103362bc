#include "tests/daemon/runner/fakes.h"

#include <algorithm>
#include <cmath>

#include "drivers/error.h"

namespace cellcal::daemon::testing {

namespace {

using drivers::MoveKind;
using drivers::MoveOutcome;

constexpr double kTouchSpacing = 0.1;
constexpr double kSearch = 0.018;
constexpr double kBehindSurface = 0.008;
constexpr double kOvertravel = 0.0002;
constexpr std::chrono::milliseconds kTransitTime{500};

/// Surface of the sphere for which a search to here is made.
double surface_before(double target_rad) {
  return std::floor(target_rad / kTouchSpacing) * kTouchSpacing + kSearch - kBehindSurface;
}

/// At its time the sensor's stamps reveal the origin of the silence.
void attribute_silence(World& w) {
  if (w.clock.now() < w.told_at) return;
  w.told_at = drivers::TimePoint::max();
  ++(w.script.sensor_silent ? w.sensor_silent : w.sensor_late);
}

/// Late replies leave the link up; without packets it is down for a while, and not referenced. Late
/// bytes do not concern the robot.
void interrupt(World& w, drivers::Interruption by) {
  w.busy_from = w.clock.now();
  if (by == drivers::Interruption::kLateBytes) {
    ++w.sensor_late;
    return;
  }
  if (by == drivers::Interruption::kUnheard) {
    w.told_at = w.clock.now() + std::chrono::milliseconds(w.script.told_after_ms);
    return;
  }
  w.interrupted_by = by;
  ++w.interruptions;
  if (by == drivers::Interruption::kLateReplies) {
    w.late += 3;
    return;
  }
  w.referenced = false;
  w.down_until = w.script.never_back
                     ? drivers::TimePoint::max()
                     : w.clock.now() + std::chrono::milliseconds(w.script.lost_for_ms);
  if (w.script.other_session) ++w.session;
  w.at_rad += w.script.moved_meanwhile_rad;
}

}  // namespace

void FakeRobot::open() {
  if (!w_.script.open_robot_error.empty()) {
    throw drivers::DriverError(w_.script.open_robot_error);
  }
  w_.robot_open = true;
  ++w_.opened;
}

drivers::RobotState FakeRobot::state() const {
  drivers::RobotState state;
  state.actual_rad = {w_.at_rad};
  state.commanded_rad = {w_.at_rad};
  state.moving = w_.moving;
  state.link = w_.referenced ? drivers::RobotLink::kReady : drivers::RobotLink::kNotReferenced;
  if (w_.script.robot_never_ready) {
    state.link = drivers::RobotLink::kDown;
    state.words = "no packet on port 49152";
  }
  if (w_.robot_lost || w_.clock.now() < w_.down_until) state.link = drivers::RobotLink::kLost;
  state.interruption = w_.interrupted_by;
  state.interruptions = w_.interruptions;
  state.session = w_.session;
  state.late = w_.late;
  state.mode = w_.script.mode;
  state.override_percent = w_.script.override_percent;
  if (w_.script.late_again && w_.interruptions > 0) {
    state.late += static_cast<std::uint64_t>(w_.clock.now().time_since_epoch() /
                                             std::chrono::milliseconds(300));
  }
  return state;
}

void FakeRobot::rereference() {
  ++w_.references;
  w_.referenced = !w_.script.never_referenced;
  w_.interrupted_by = drivers::Interruption::kNone;
}

void FakeRobot::begin(const drivers::Move& move) {
  w_.begun.push_back(move.id);
  if (static_cast<int>(w_.begun.size()) == w_.script.begin_throws_at) {
    throw drivers::DriverError("socket gone");
  }
  w_.stop_asked = false;
  legs_.clear();
  drivers::Move leg = move;
  leg.via.clear();
  for (const drivers::Via& via : move.via) {
    leg.target_rad = via.at_rad;
    legs_.push_back(leg);
    if (leg.kind == MoveKind::kRetreat) leg.kind = MoveKind::kTransit;
  }
  leg.target_rad = move.target_rad;
  legs_.push_back(leg);
  begin_leg();
}

void FakeRobot::begin_leg() {
  w_.moves.push_back(legs_.front());
  legs_.pop_front();
  w_.moving = true;
  const double cruise_s = w_.moves.back().cruise_s;
  const auto cruise = std::chrono::microseconds(std::llround(cruise_s * 1e6));
  w_.ends = w_.clock.now() + (cruise_s > 0.0 ? drivers::Duration(cruise) : kTransitTime);
}

void FakeRobot::stop() {
  ++w_.stops;
  w_.stop_asked = true;
}

MoveOutcome FakeRobot::natural_outcome(const drivers::Move& move) const {
  if (w_.stop_asked) return MoveOutcome::kStopped;
  const auto scripted = w_.script.outcome.find(static_cast<int>(w_.moves.size()));
  if (scripted != w_.script.outcome.end()) return scripted->second;
  return move.kind == MoveKind::kSearch ? MoveOutcome::kContact : MoveOutcome::kArrived;
}

std::optional<drivers::MoveResult> FakeRobot::poll() {
  if (!w_.moving) return std::nullopt;
  const int number = static_cast<int>(w_.moves.size());
  const bool stopping = w_.stop_asked && !w_.script.ignores_stop;
  const bool endless = number >= w_.script.endless_from;
  if (!stopping && (endless || w_.clock.now() < w_.ends)) return std::nullopt;
  w_.moving = false;
  const drivers::Move& move = w_.moves.back();
  drivers::MoveResult result;
  result.id = move.id;
  result.outcome = natural_outcome(move);
  if (result.outcome == MoveOutcome::kArrived) w_.at_rad = move.target_rad[0];
  if (move.kind == MoveKind::kRetreat && result.outcome == MoveOutcome::kArrived) {
    w_.in_contact = false;
  }
  if (result.outcome == MoveOutcome::kContact) {
    const auto late = w_.script.late_m.find(number);
    const double contact =
        surface_before(move.target_rad[0]) + (late == w_.script.late_m.end() ? 0.0 : late->second);
    w_.at_rad = contact + kOvertravel;
    drivers::Latch latch;
    const auto off = w_.script.latch_off_m.find(static_cast<int>(w_.moves.size()));
    latch.contact_rad = {contact + (off == w_.script.latch_off_m.end() ? 0.0 : off->second)};
    latch.settled_rad = {w_.at_rad};
    latch.contact_time = w_.clock.now();
    result.latch = latch;
    w_.in_contact = true;
    drivers::ContactRecord record;
    record.kind = drivers::ContactEventKind::kContact;
    record.arm_id = move.arm_id;
    record.event = static_cast<std::uint16_t>(w_.moves.size());
    record.ticks = 4000000000u;
    record.sense_v = 0.25;
    record.heard = record.first_edge = w_.clock.now();
    w_.records.push_back(record);
  }
  if (result.outcome == MoveOutcome::kArrived && !legs_.empty()) {
    begin_leg();
    return std::nullopt;
  }
  result.at_rad = {w_.at_rad};
  if (const auto by = w_.script.interruption.find(number); by != w_.script.interruption.end()) {
    result.interruption = by->second;
    interrupt(w_, by->second);
  }
  return result;
}

void FakeRobot::close() { w_.robot_open = false; }

void FakeContact::open() {
  if (!w_.script.open_contact_error.empty()) {
    throw drivers::DriverError(w_.script.open_contact_error);
  }
  w_.contact_open = true;
  w_.in_contact = w_.script.contact_closed;
}

drivers::ContactStatus FakeContact::status() const {
  drivers::ContactStatus status;
  status.in_contact = w_.in_contact;
  status.loop_ok = true;
  // As in the real one: no self-test, hence not ready, before the contact has been open once.
  const bool proven =
      !(w_.script.contact_closed && w_.in_contact) && !w_.script.contact_never_ready;
  status.self_test_ok = proven && w_.clock.now() >= w_.proven_from;
  status.can_guard_retreat = !w_.script.contact_never_ready;
  status.link = proven ? drivers::ContactLink::kReady : drivers::ContactLink::kIdentifying;
  if (w_.script.contact_never_ready) status.words = "no IDENT from /dev/ttyUSB0";
  status.clock_ok = proven;
  attribute_silence(w_);
  status.delivery = {w_.sensor_late, w_.sensor_silent, w_.told_at != drivers::TimePoint::max()};
  const auto busy = std::min<drivers::Duration>(w_.clock.now() - w_.busy_from,
                                                std::chrono::milliseconds(w_.script.busy_for_ms));
  status.delivery.late += static_cast<std::uint32_t>(busy / std::chrono::milliseconds(100));
  if (w_.sensor_fault) {
    status.link = drivers::ContactLink::kFault;
    status.words = "sense line broken";
  }
  return status;
}

void FakeContact::arm(std::uint16_t arm_id, std::chrono::milliseconds) {
  ++w_.armings;
  if (w_.armings >= w_.script.robot_lost_at_arming) w_.robot_lost = true;
  if (w_.armings == w_.script.pause_at_arming) {
    interrupt(w_, drivers::Interruption::kPacketsStopped);
    return;
  }
  if (w_.armings >= w_.script.sensor_fault_at_arming) w_.sensor_fault = true;
  if (w_.armings == w_.script.late_at_arming) {
    interrupt(w_, drivers::Interruption::kLateBytes);
    w_.arm_answer = drivers::ArmResult{arm_id, false, drivers::ArmRefusal::kNoAnswer, "no answer"};
    return;
  }
  if (w_.script.arming_unanswered || w_.robot_lost || w_.sensor_fault) return;
  drivers::ArmResult answer;
  answer.arm_id = arm_id;
  answer.armed = w_.armings > w_.script.refused_armings;
  if (!answer.armed) {
    answer.refusal = drivers::ArmRefusal::kSelfTestOld;
    answer.why_not = "self-test too old";
  }
  w_.arm_answer = answer;
}

std::optional<drivers::ArmResult> FakeContact::poll_arm() {
  return std::exchange(w_.arm_answer, std::nullopt);
}

std::optional<drivers::ContactRecord> FakeContact::next_record() {
  if (w_.records.empty()) return std::nullopt;
  const drivers::ContactRecord record = w_.records.front();
  w_.records.pop_front();
  return record;
}

void FakeContact::disarm() { ++w_.disarmings; }

void FakeContact::self_test() {
  ++w_.self_tests;
  w_.proven_from = w_.clock.now() + std::chrono::milliseconds(30);
  if (w_.self_tests >= w_.script.sensor_fault_at_self_test) w_.sensor_fault = true;
}

void FakeContact::close() { w_.contact_open = false; }

void FakeRecorder::count() {
  ++calls;
  if (calls >= fails_at && calls - fails_at < fails_for)
    throw std::runtime_error("journal x.db: disk full; make room");
}

void FakeRecorder::record(const RecordPlan&) { count(); }
void FakeRecorder::record(const RecordReading& reading) {
  count();
  readings.push_back(reading);
}
void FakeRecorder::record(const RecordTouch& touch) {
  count();
  touches.push_back(touch);
}
void FakeRecorder::record(const RecordSearch& search) {
  count();
  searches.push_back(search);
}
void FakeRecorder::record(const RecordEnd& end) {
  count();
  ends.push_back(end);
}

calib::Plan line_plan(std::size_t touches) {
  calib::Plan plan;
  plan.start = {0.0};
  for (std::size_t i = 0; i < touches; ++i) {
    const double standoff = kTouchSpacing * static_cast<double>(i + 1);
    calib::PlannedTouch touch;
    touch.target = "S" + std::to_string(i + 1);
    touch.set = i % 2 == 0 ? calib::TouchSet::kFit : calib::TouchSet::kCheck;
    touch.transit = {{standoff - 0.05}, {standoff}};
    touch.corners = {{0.1, 0.2}, {0.3, 0.4}};
    touch.leaving = {0.15, 0.25};
    touch.standoff = {standoff};
    touch.end = {standoff + kSearch};
    touch.clear = {standoff - 0.01};
    touch.search_m = kSearch;
    touch.expected_m = kSearch - kBehindSurface;
    plan.touches.push_back(touch);
  }
  plan.home = {{0.05}, {0.0}};
  return plan;
}

Tasks line_tasks(std::size_t touches) {
  Tasks tasks;
  tasks.plan = [touches] {
    return Tasks::Planned{line_plan(touches), "hash of " + std::to_string(touches)};
  };
  tasks.route = [](const calib::Plan& plan, const FindRoute&, const calib::JointVector&) {
    return plan;
  };
  tasks.assess = [](const std::vector<calib::Touch>& made) -> Tasks::Assessed {
    return {static_cast<double>(made.size())};
  };
  tasks.identify = [](const std::vector<calib::Touch>& made) {
    calib::Calibration calibration;
    calibration.after.count = static_cast<int>(made.size());
    return SessionResult{calibration};
  };
  tasks.report = [](const SessionResult&, const std::vector<calib::Touch>&) {};
  return tasks;
}

Session::Session(Script script, std::size_t touches)
    : backend(std::move(script)), tasks(line_tasks(touches)) {
  phases.push_back(Phase::kIdle);
  start.policy.confirm_every = 1;  // all elements of a touch
}

State Session::run() { return run_and_abort_in(Phase::kIdle); }

State Session::run_and_abort_in(Phase abort_in) {
  start.done = done.size();
  Runner* running = nullptr;
  Runner runner({backend, recorder, worker, disk, tasks,
                 [&](const State& state, const std::vector<calib::Touch>&) {
                   if (state.phase != phases.back()) {
                     phases.push_back(state.phase);
                     if (on_phase) on_phase(state.phase);
                   }
                   // A pending move needs no stop.
                   if (state.phase == abort_in && !state.held) running->request_abort();
                   if (watch) watch(state, *running);
                 }},
                start, done);
  running = &runner;
  const State end = runner.run();
  done = runner.touches();
  return end;
}

}  // namespace cellcal::daemon::testing
