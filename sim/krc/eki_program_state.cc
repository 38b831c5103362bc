// State of the robot interpreter's program: selected, running, stopped, cancelled.

#include "sim/krc/eki_programs.h"

namespace cellcal::sim {

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
