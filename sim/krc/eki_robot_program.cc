// The robot interpreter: moves, interrupts, brake ramps.

#include <algorithm>
#include <cmath>

#include "sim/krc/eki_programs.h"

namespace cellcal::sim {

namespace {

using drivers::EkiGuard;
using drivers::EkiPath;

// 250 mm/s at the flange, as a share of an axis' full speed on an arm of 1.4 m.
constexpr double kT1Share = 0.06;

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
    const double limit =
        kT1Share * *std::min_element(config.max_speed_rad_s.begin(), config.max_speed_rad_s.end());
    scale = std::min(scale, limit / (line_speed * line_travel));
  }
  arm.scale(manual() && !start_held ? 0.0 : scale);
}

void EkiPrograms::tick(TimePoint now, const Faults& faults) {
  take_edges(now);
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
  look_at_channel();
}

void EkiPrograms::take_edges(TimePoint now) {
  while (!edges.empty() && edges.front().first <= now) {
    const auto [at, closed] = edges.front();
    edges.pop_front();
    if (closed && !input_level && !input_edge) {
      input_edge = noisy(config.latches_setpoint ? arm.setpoint() : arm.actual_at(at));
    }
    input_level = closed;
  }
}

}  // namespace cellcal::sim
