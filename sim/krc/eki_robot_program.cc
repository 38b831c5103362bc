// The robot interpreter: moves, interrupts, brake ramps.

#include "sim/krc/eki_robot_program.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "drivers/kuka/wire/xml_values.h"
#include "drivers/units.h"

namespace cellcal::sim {

namespace {

using drivers::EkiGuard;
using drivers::EkiPath;

// 250 mm/s at the flange, as a share of an axis' full speed on an arm of 1.4 m.
constexpr double kT1PtpShare = 0.06;

}  // namespace

void EkiPrograms::finish(EkiOutcome how) {
  ordered = busy = false;
  if (phase != Phase::kDropped) phase = Phase::kIdle;
  if (!fresh_session) outcome = how;
  if (fresh_session) reported_id = 0;
  stop_flag = false;
  stop_reason = EkiOutcome::kStop;
}

bool EkiPrograms::outside_soft_limits() const {
  for (std::size_t i = 0; i < axes; ++i) {
    if (i < config.soft_min_rad.size() && order.target_rad[i] < config.soft_min_rad[i]) return true;
    if (i < config.soft_max_rad.size() && order.target_rad[i] > config.soft_max_rad[i]) return true;
  }
  return false;
}

double EkiPrograms::path_m(double travel_rad) const {
  if (!config.arm) return travel_rad;
  constexpr double kShortestM = 1e-6;
  const KukaFrame from = config.arm->frame(arm.setpoint()),
                  to = config.arm->frame(order.target_rad);
  return std::max(kShortestM, 1e-3 * std::hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]));
}

void EkiPrograms::begin_move() {
  ordered = false;
  if (stop_flag) return finish(stop_reason);
  // Interrupts are edge triggered: an input that is already on would never fire.
  guarded = order.guard == static_cast<int>(EkiGuard::kInput);
  if (guarded && input_level) return finish(EkiOutcome::kInputAtStart);
  if (outside_soft_limits()) return finish(EkiOutcome::kSoftLimit);
  double speed = 1e9, acceleration = 1e9, travel = 0.0;
  const bool lin = order.path == static_cast<int>(EkiPath::kLin);
  if (order.percent < 1 || order.percent > 100 || (lin && !(order.duration_s > 0.0))) {
    return finish(EkiOutcome::kNotFeasible);
  }
  for (std::size_t i = 0; i < axes; ++i) {
    const double share = std::abs(order.target_rad[i] - arm.setpoint()[i]);
    travel = std::max(travel, share);
    if (share <= 0.0) continue;
    speed =
        std::min(speed, config.max_speed_rad_s[i] / share * (lin ? 1.0 : order.percent / 100.0));
    acceleration = std::min(acceleration, config.max_acceleration_rad_s2 / share);
  }
  if (travel <= 0.0) return finish(EkiOutcome::kArrived);
  if (lin) speed = std::min(speed, 1.0 / order.duration_s);
  ++moves;
  line_speed = speed;
  line_travel = travel;
  axes_acceleration = acceleration;
  line_acceleration =
      lin ? std::min(acceleration, config.lin_acceleration_m_s2 / path_m(travel)) : acceleration;
  input_edge.reset();
  go();
}

void EkiPrograms::go() {
  arm.go(order.target_rad, line_speed, line_acceleration);
  phase = Phase::kMoving;
}

void EkiPrograms::brake(EkiOutcome how, bool fast) {
  arm.brake(fast ? config.fast_brake_factor * axes_acceleration : line_acceleration);
  braking_for = how;
  phase = Phase::kBraking;
}

void EkiPrograms::interrupts(TimePoint now) {
  if (phase != Phase::kMoving) return;
  if (guarded && input_edge) {
    latch = *input_edge;
    latch_id = order.id;
    brake(EkiOutcome::kInput, order.path != static_cast<int>(EkiPath::kLin));
  } else if (stop_flag) {
    brake(stop_reason, true);
  } else if (timer_ran_out(now)) {
    brake(EkiOutcome::kDeadMan, true);
  }
}

void EkiPrograms::scale_speed() {
  double scale = override_percent / 100.0;
  if (mode == EkiMode::kT1 && line_travel > 0.0) {
    const double limit = kT1PtpShare * *std::min_element(config.max_speed_rad_s.begin(),
                                                         config.max_speed_rad_s.end());
    scale = std::min(scale, limit / (line_speed * line_travel));
  }
  arm.scale(manual() && !start_held ? 0.0 : scale);
}

void EkiPrograms::tick(TimePoint now, const Faults& faults) {
  read_input_edges(now);
  scale_speed();
  const bool interrupt_cycle = cycles % (config.interrupt_ms / config.cycle_ms) == 0;
  if (interrupt_cycle && program_state() == ProgramState::kActive && !stopping) {
    if (ordered) begin_move();
    interrupts(now);
    leave_program();
  }
  arm.tick(now, 1e-3 * config.cycle_ms);
  settle();
  if (!faults.submit_halted) run_submit(now, faults);
  ++cycles;
}

void EkiPrograms::run_submit(TimePoint now, const Faults& faults) {
  watch_connection(now);
  // Without a session a pass waits for 12 ms, and every second one sends a state.
  const int every_ms = session == 0 ? config.idle_state_ms : config.state_ms;
  if (cycles % (every_ms / config.cycle_ms) != 0) return;
  time_pass(now);
  if (!faults.deaf) read_telegrams(now, faults.forgetful);
  if (!faults.deaf && has_frames) attend_frame(now);
  watch(now);
  wait_for_session(now);
  if (!faults.muted) send_state(now);
  examine_channel();
}

void EkiPrograms::read_input_edges(TimePoint now) {
  while (!edges.empty() && edges.front().first <= now) {
    const auto [at, closed] = edges.front();
    edges.pop_front();
    if (closed && !input_level && !input_edge) {
      input_edge = noisy(config.latches_setpoint ? arm.setpoint() : arm.actual_at(at));
    }
    input_level = closed;
  }
}

// Handling of TOOL_DATA and BASE_DATA by the submit program (CC_FRAME of cellcal_sub.sub).

namespace {

using drivers::EkiFrameDone;
using drivers::EkiFrameKind;
using drivers::EkiFrameValues;

constexpr std::chrono::milliseconds kRest{300};
constexpr double kRestRad = 0.01 * drivers::kRadPerDeg;

std::string component(const char* element, std::size_t i) {
  return std::string("Robot") + element + "/@" + drivers::wire::kFrameNames[i];
}

}  // namespace

void EkiPrograms::on_frame_telegram(TimePoint now) {
  bool whole = channel.waiting("RobotCommand/Frame/@C") > 0;
  const auto number = [&](const std::string& path) {
    const auto value = channel.get(path);
    whole = whole && value.has_value();
    return value.value_or(0.0);
  };
  drivers::EkiFrameCommand asked;
  asked.ask = static_cast<std::uint32_t>(std::max(0.0, number("RobotCommand/Frame/@Ask")));
  if (whole) {
    asked.set = number("RobotCommand/Frame/@Do") == 2.0;
    asked.kind = static_cast<EkiFrameKind>(static_cast<int>(number("RobotCommand/Frame/@Kind")));
    asked.number = static_cast<int>(number("RobotCommand/Frame/@Number"));
    for (std::size_t i = 0; i < asked.values.size(); ++i)
      asked.values[i] = number(component("Command/Frame", i));
  }
  frame_waits = whole;
  if (!whole) {
    ++bad;
    frame_answer.ask = asked.ask;
    frame_answer.done = EkiFrameDone::kIncomplete;
    for (const auto& [path, type] : channel.config().receive) {
      while (channel.get(path)) {
      }
    }
    return;
  }
  frame_order = asked;
  frame_answer = {.ask = asked.ask, .set = asked.set, .kind = asked.kind, .number = asked.number};
  frame_rest = arm.actual_at(now);
  frame_at = now;
}

EkiFrameDone EkiPrograms::frame_objection(TimePoint now) const {
  if (frame_order.kind == EkiFrameKind::kAdvice && config.supports_advice) {
    const double code = frame_order.values[1];
    return frame_order.number == 1 && code >= 0.0 && code <= 5.0 ? EkiFrameDone::kNotYet
                                                                 : EkiFrameDone::kNoSuchNumber;
  }
  if (session != 0 || busy) return EkiFrameDone::kInSession;
  const std::vector<double> at = arm.actual_at(now);
  for (std::size_t i = 0; i < axes; ++i)
    if (!(std::abs(at[i] - frame_rest[i]) < kRestRad)) return EkiFrameDone::kMoves;
  const bool known = config.supports_frames && (frame_order.kind == EkiFrameKind::kTool ||
                                                frame_order.kind == EkiFrameKind::kBase);
  if (!known || frame_order.number < 1 ||
      static_cast<std::size_t>(frame_order.number) > frames_of(frame_order.kind).size())
    return EkiFrameDone::kNoSuchNumber;
  if (program_state() == ProgramState::kActive && !ours) return EkiFrameDone::kOtherProgram;
  return EkiFrameDone::kNotYet;
}

void EkiPrograms::attend_frame(TimePoint now) {
  if (!channel.connected()) return;
  if (channel.waiting("RobotCommand/Frame/@Ask") > 0) on_frame_telegram(now);
  if (!frame_waits) return;
  frame_answer.done = frame_objection(now);
  if (frame_answer.done == EkiFrameDone::kNotYet && frame_order.kind == EkiFrameKind::kAdvice) {
    const auto values = [this] {
      return EkiFrameValues{static_cast<double>(config.advice_until),
                            static_cast<double>(config.advice)};
    };
    frame_answer.old_values = values();
    if (frame_order.set) {  // KRL rounds a REAL assigned to an INT
      config.advice_until = static_cast<int>(std::lround(frame_order.values[0]));
      config.advice = static_cast<int>(std::lround(frame_order.values[1]));
    }
    frame_answer.new_values = values();
    frame_answer.done = EkiFrameDone::kDone;
  } else if (frame_answer.done == EkiFrameDone::kNotYet && now - frame_at >= kRest) {
    auto& all = frame_order.kind == EkiFrameKind::kTool ? config.tool_data : config.base_data;
    EkiFrameValues& one = all[static_cast<std::size_t>(frame_order.number) - 1];
    frame_answer.old_values = one;
    if (frame_order.set) {
      one = frame_order.values;
      ++frames_set;
    }
    frame_answer.new_values = one;
    frame_answer.done = EkiFrameDone::kDone;
  }
  if (frame_answer.done != EkiFrameDone::kNotYet) frame_waits = false;
}

void EkiPrograms::send_frame() {
  const auto put = [&](const char* name, auto value) {
    channel.set(std::string("RobotState/Frame/@") + name,
                std::to_string(static_cast<std::uint64_t>(value)));
  };
  put("Ask", frame_answer.ask);
  put("Do", frame_answer.set ? 2 : 1);
  put("Kind", frame_answer.kind);
  put("Number", frame_answer.number);
  put("Done", frame_answer.done);
  for (std::size_t i = 0; i < frame_answer.old_values.size(); ++i) {
    channel.set(component("State/FrameOld", i), krl_real(frame_answer.old_values[i]));
    channel.set(component("State/FrameNew", i), krl_real(frame_answer.new_values[i]));
  }
}

// State of the robot interpreter's program: selected, running, stopped, cancelled.

namespace {

// Deceleration of a safety stop, harder than BRAKE F: relative to PTP's acceleration.
constexpr double kSafetyFactor = 4.0;

}  // namespace

EkiPrograms::ProgramState EkiPrograms::program_state() const {
  const bool released = manual() && !start_held;
  return program == ProgramState::kActive && released ? ProgramState::kStop : program;
}

bool EkiPrograms::is_ready() const {
  return ready && ours && !leave && program_state() == ProgramState::kActive && drives_on &&
         !e_stop && !stop_message;
}

bool EkiPrograms::timer_ran_out(TimePoint now) const {
  return now - heard_at > std::chrono::milliseconds(config.dead_man_ms);
}

void EkiPrograms::start(bool cellcal) {
  stop_message = false;
  fault = 0;
  if (program == ProgramState::kActive && ours == cellcal) return;  // it runs, or still brakes
  if (program == ProgramState::kStop && ours == cellcal) {
    program = ProgramState::kActive;
    if (phase == Phase::kHeld) go();
    return;
  }
  // From the start: values set by CELLCAL_EKI before its loop.
  program = ProgramState::kActive;
  ours = cellcal;
  stopping = cancelling = under_cell = at_end = false;
  if (!cellcal) return;
  called = mode == EkiMode::kExt;
  leave = false;
  idle_since.reset();
  phase = Phase::kIdle;
  ordered = busy = stop_flag = false;
  reported_id = 0;
  outcome = EkiOutcome::kNone;
  ready = true;
}

void EkiPrograms::part() {
  if (session != 0) leave = called;
  session = 0;
}

void EkiPrograms::run_program() {
  if (!config.may_run || mode != EkiMode::kExt || busy || !drives_on || e_stop || stop_message)
    return;
  if (program != ProgramState::kFree) return;
  if (at_end) {
    at_end = false;
    return;
  }
  start(true);
}

void EkiPrograms::leave_program() {
  if (!ours || !leave || ordered || busy || phase != Phase::kIdle) return;
  leave = ready = ours = false;
  if (under_cell) return;
  program = ProgramState::kFree;
  at_end = true;
}

void EkiPrograms::wait_for_session(TimePoint now) {
  if (!ready || !called || session != 0) {
    idle_since.reset();
    return;
  }
  if (!idle_since) idle_since = now;
  if (now - *idle_since > std::chrono::seconds(config.cell_wait_s)) leave = true;
}

void EkiPrograms::stop_program() {
  if (program != ProgramState::kActive) return;
  stopping = true;
  if (phase == Phase::kMoving || phase == Phase::kBraking)
    arm.brake(kSafetyFactor * axes_acceleration);
  settle();
}

bool EkiPrograms::cancel() {
  if (program_state() == ProgramState::kActive) return false;
  program = ProgramState::kFree;
  stopping = cancelling = false;
  if (phase == Phase::kIdle) return true;
  arm.brake(kSafetyFactor * axes_acceleration);
  phase = Phase::kDropped;
  settle();
  return true;
}

void EkiPrograms::settle() {
  if (phase != Phase::kIdle && phase != Phase::kHeld && !arm.at_rest()) return;
  if (phase == Phase::kDropped) phase = Phase::kIdle;
  if (stopping) {
    stopping = false;
    program = ProgramState::kStop;
    if (phase != Phase::kIdle) phase = Phase::kHeld;
    if (cancelling) cancel();
    return;
  }
  if (phase == Phase::kMoving) finish(EkiOutcome::kArrived);
  if (phase == Phase::kBraking) finish(braking_for);
}

}  // namespace cellcal::sim
