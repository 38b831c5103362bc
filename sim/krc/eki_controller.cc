#include "sim/krc/eki_controller.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <deque>
#include <numbers>
#include <random>
#include <stdexcept>

#include "sim/krc/eki_arm.h"

namespace cellcal::sim {
namespace {

using drivers::Duration;
using drivers::EkiGuard;
using drivers::EkiMode;
using drivers::EkiOutcome;
using drivers::EkiPath;
using drivers::EkiProgress;
using drivers::EkiType;
using drivers::TimePoint;

constexpr double kDegPerRad = 180.0 / std::numbers::pi;
constexpr double kRadPerDeg = std::numbers::pi / 180.0;
constexpr double kUsualSpeed = 3.0;
// 250 mm/s at the flange, as a share of an axis' full speed on an arm of 1.4 m.
constexpr double kT1Share = 0.06;
// A stop by safety is harder than BRAKE.
constexpr double kSafetyFactor = 4.0;

std::string real(double value) {
  // KRL's REAL is a 32-bit float; EKI writes six decimals.
  std::array<char, 64> buffer{};
  const auto end =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(),
                    static_cast<double>(static_cast<float>(value)), std::chars_format::fixed, 6);
  return {buffer.data(), end.ptr};
}

std::string axis_path(std::string_view root, std::string_view first, std::string_view external,
                      std::size_t i) {
  const bool own = i < 6;
  return std::string(root) + '/' + std::string(own ? first : external) + "/@" + (own ? 'A' : 'E') +
         std::to_string(i % 6 + 1);
}

}  // namespace

struct EkiController::Impl {
  explicit Impl(EkiControllerConfig c)
      : config(std::move(c)),
        channel(EkiChannelConfig::parse(config.channel_xml)),
        arm(config.start_rad, config.lag_s),
        random(config.seed) {
    axes = config.start_rad.size();
    if (axes == 0 || axes > drivers::kMaxAxes) {
      throw std::invalid_argument("emulated EKI controller: 1 to 12 axes");
    }
    if (config.cycle_ms <= 0 || config.interrupt_ms % config.cycle_ms != 0 ||
        config.state_ms % config.cycle_ms != 0 || !(config.lag_s > 0.0)) {
      throw std::invalid_argument(
          "emulated EKI controller: interrupt_ms and state_ms must be multiples of cycle_ms, lag_s "
          "positive");
    }
    if (config.max_speed_rad_s.empty()) config.max_speed_rad_s.assign(axes, kUsualSpeed);
    if (config.max_speed_rad_s.size() != axes) {
      throw std::invalid_argument("emulated EKI controller: max_speed_rad_s needs one per axis");
    }
    latch = config.start_rad;
    channel.open();
  }

  // ---- the submit program ----------------------------------------------------------------------

  struct Telegram {
    std::uint32_t session = 0, seq = 0, id = 0;
    int type = 0, guard = 0, path = 0, percent = 0;
    double duration_s = 0.0;
    std::vector<double> target_rad;
  };

  /// One value of each element, or none: then the queues are out of step and are emptied.
  std::optional<Telegram> take_telegram() {
    Telegram t;
    bool whole = true;
    const auto number = [&](const std::string& path) {
      const auto value = channel.get(path);
      whole = whole && value.has_value();
      return value.value_or(0.0);
    };
    const auto natural = [&](const char* path) {
      const double value = number(path);
      if (value < 0.0) whole = false;
      return static_cast<std::uint32_t>(std::max(0.0, value));
    };
    t.session = natural("RobotCommand/@Session");
    t.seq = natural("RobotCommand/@Seq");
    t.type = static_cast<int>(natural("RobotCommand/@Type"));
    t.id = natural("RobotCommand/@Id");
    for (std::size_t i = 0; i < axes; ++i) {
      t.target_rad.push_back(number(axis_path("RobotCommand", "Axis", "Ext", i)) * kRadPerDeg);
    }
    t.guard = static_cast<int>(natural("RobotCommand/Move/@Guard"));
    t.path = static_cast<int>(natural("RobotCommand/Move/@Path"));
    t.percent = static_cast<int>(natural("RobotCommand/Move/@Percent"));
    t.duration_s = number("RobotCommand/Move/@Duration");
    if (whole) return t;
    ++bad;
    for (const auto& [path, type] : channel.config().receive) {
      while (channel.get(path)) {
      }
    }
    return std::nullopt;
  }

  void read_telegrams(TimePoint now, bool forgetful) {
    while (channel.waiting("RobotCommand/@Seq") > 0) {
      const auto telegram = take_telegram();
      if (!telegram) return;
      obey(*telegram, now, forgetful);
    }
  }

  void obey(const Telegram& t, TimePoint now, bool forgetful) {
    if (t.type == static_cast<int>(EkiType::kHello)) {
      stop_motion();
      session = t.session;
      heard = t.seq;
      heard_at = now;
      last_id = 0;
      reported_id = 0;
      outcome = EkiOutcome::kNone;
      fresh_session = true;
      return;
    }
    if (t.session != session || session == 0) return;
    heard = t.seq;
    heard_at = now;
    switch (static_cast<EkiType>(t.type)) {
      case EkiType::kMove:
        if (t.id <= last_id || busy()) return;
        last_id = t.id;
        if (!forgetful) take_move(t);
        break;
      case EkiType::kStop:
        if (t.id >= last_id) stop_motion();
        last_id = std::max(last_id, t.id);
        break;
      case EkiType::kBye:
        stop_motion();
        session = 0;
        break;
      case EkiType::kHello:
      case EkiType::kBeat:
        break;
    }
  }

  void take_move(const Telegram& t) {
    reported_id = t.id;
    fresh_session = false;
    outcome = EkiOutcome::kNone;
    order = t;
    if (!is_ready()) return finish(EkiOutcome::kAborted);
    ordered = true;  // the robot program takes it in its next cycle
  }

  void stop_motion() {
    if (busy()) stop_flag = true;
  }

  void watch_dead_man(TimePoint now) {
    if (session == 0) return;
    if (now - heard_at <= std::chrono::milliseconds(config.dead_man_ms)) return;
    if (busy() && !stop_flag) {
      stop_flag = true;
      stop_reason = EkiOutcome::kDeadMan;
    }
  }

  void watch_connection(TimePoint now) {
    if (channel.connected()) {
      was_connected = true;
      return;
    }
    if (was_connected) {
      was_connected = false;
      stop_motion();
      session = 0;
      if (config.clears_on_reconnect) {
        channel.clear();
      } else {
        channel.close();
      }
      reopen_at = now + std::chrono::milliseconds(config.reopen_ms);
    }
    if (now >= reopen_at) channel.open();
  }

  std::vector<double> noisy(std::vector<double> rad) {
    std::normal_distribution<double> noise(0.0, config.noise_sigma_deg * kRadPerDeg);
    if (config.noise_sigma_deg > 0.0) {
      for (double& value : rad) value += noise(random);
    }
    return rad;
  }

  void send_state(TimePoint now) {
    const auto put = [&](const char* path, std::uint64_t value) {
      channel.set(path, std::to_string(value));
    };
    const auto flag = [&](const char* path, bool value) { put(path, value ? 1 : 0); };
    const std::vector<double> at = noisy(arm.actual_at(now));
    for (std::size_t i = 0; i < axes; ++i) {
      channel.set(axis_path("RobotState", "Axis", "Ext", i), real(at[i] * kDegPerRad));
      channel.set(axis_path("RobotState", "Latch", "LatchExt", i), real(latch[i] * kDegPerRad));
    }
    put("RobotState/@Session", session);
    put("RobotState/@Heard", heard);
    const auto ms =
        std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()).count();
    constexpr std::uint64_t kLargestInt = 0x7FFFFFFF;
    put("RobotState/@Time",
        static_cast<std::uint64_t>(ms - ms % std::max(1, config.timer_ms)) & kLargestInt);
    const EkiProgress progress = busy()             ? EkiProgress::kMoving
                                 : reported_id != 0 ? EkiProgress::kDone
                                                    : EkiProgress::kIdle;
    put("RobotState/Move/@Id", reported_id);
    put("RobotState/Move/@State", static_cast<std::uint64_t>(progress));
    put("RobotState/Move/@Outcome", static_cast<std::uint64_t>(outcome));
    put("RobotState/Latch/@Id", latch_id);
    flag("RobotState/Status/@Ready", is_ready());
    put("RobotState/Status/@Mode", static_cast<std::uint64_t>(mode));
    flag("RobotState/Status/@Drives", drives_on && !e_stop);
    flag("RobotState/Status/@Stopped", stop_message);
    put("RobotState/Status/@Override", static_cast<std::uint64_t>(override_percent));
    flag("RobotState/Status/@Input", input_level);
    put("RobotState/Status/@Fault", fault);
    put("RobotState/Status/@Bad", bad);
    channel.send("RobotState");
  }

  // ---- the robot program -----------------------------------------------------------------------

  bool is_ready() const { return program_runs && drives_on && !e_stop && !stop_message; }
  bool busy() const { return ordered || phase != Phase::kIdle; }

  void finish(EkiOutcome how) {
    ordered = false;
    phase = Phase::kIdle;
    if (!fresh_session) outcome = how;
    if (fresh_session) reported_id = 0;
    stop_flag = false;
    stop_reason = EkiOutcome::kStop;
  }

  bool outside_soft_limits() const {
    for (std::size_t i = 0; i < axes; ++i) {
      if (i < config.soft_min_rad.size() && order.target_rad[i] < config.soft_min_rad[i])
        return true;
      if (i < config.soft_max_rad.size() && order.target_rad[i] > config.soft_max_rad[i])
        return true;
    }
    return false;
  }

  void begin_move() {
    ordered = false;
    if (stop_flag) return finish(stop_reason);
    // Interrupts are edge triggered: an input that is on already would never fire.
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
    arm.go(order.target_rad, speed, acceleration);
    phase = Phase::kMoving;
    input_edge.reset();
  }

  void brake(EkiOutcome how, double factor) {
    arm.brake(factor);
    braking_for = how;
    phase = Phase::kBraking;
  }

  /// What the safety controller does to a program in the middle of a motion.
  void abort_motion() {
    if (phase == Phase::kIdle && !ordered) return;
    if (ordered) return finish(EkiOutcome::kAborted);
    brake(EkiOutcome::kAborted, kSafetyFactor);
  }

  void interrupts() {
    if (phase != Phase::kMoving) return;
    if (guarded && input_edge) {
      latch = *input_edge;
      latch_id = order.id;
      brake(EkiOutcome::kInput, config.brake_factor);
    } else if (stop_flag) {
      brake(stop_reason, config.brake_factor);
    }
  }

  void scale_speed() {
    const bool manual = mode == EkiMode::kT1 || mode == EkiMode::kT2;
    double scale = override_percent / 100.0;
    if (mode == EkiMode::kT1 && line_travel > 0.0) {
      const double limit = kT1Share * *std::min_element(config.max_speed_rad_s.begin(),
                                                        config.max_speed_rad_s.end());
      scale = std::min(scale, limit / (line_speed * line_travel));
    }
    arm.scale(manual && !start_held ? 0.0 : scale);
  }

  void tick(TimePoint now, bool muted, bool deaf, bool forgetful) {
    take_edges(now);
    scale_speed();
    const bool interrupt_cycle = cycles % (config.interrupt_ms / config.cycle_ms) == 0;
    if (interrupt_cycle) {
      if (ordered) begin_move();
      interrupts();
    }
    arm.tick(now, 1e-3 * config.cycle_ms);
    if (phase == Phase::kMoving && arm.at_rest()) finish(EkiOutcome::kArrived);
    if (phase == Phase::kBraking && arm.at_rest()) finish(braking_for);
    watch_connection(now);
    if (cycles % (config.state_ms / config.cycle_ms) == 0) {
      if (!deaf) read_telegrams(now, forgetful);
      watch_dead_man(now);
      if (!muted) send_state(now);
    }
    ++cycles;
  }

  /// Levels up to now, while the arm's path in the cycle that ends is still known.
  void take_edges(TimePoint now) {
    while (!edges.empty() && edges.front().first <= now) {
      const auto [at, closed] = edges.front();
      edges.pop_front();
      if (closed && !input_level && !input_edge) {
        input_edge = noisy(config.latches_setpoint ? arm.setpoint() : arm.actual_at(at));
      }
      input_level = closed;
    }
  }

  enum class Phase { kIdle, kMoving, kBraking };

  EkiControllerConfig config;
  EkiChannel channel;
  EkiArm arm;
  std::size_t axes = 0;
  std::mt19937_64 random;
  std::uint64_t cycles = 0, moves = 0;

  // what the submit program knows
  std::uint32_t session = 0, heard = 0, last_id = 0, reported_id = 0, bad = 0;
  TimePoint heard_at{}, reopen_at{};
  bool was_connected = false, fresh_session = false;
  EkiOutcome outcome = EkiOutcome::kNone;

  // what the robot program does
  Phase phase = Phase::kIdle;
  Telegram order;
  bool ordered = false, guarded = false, stop_flag = false;
  EkiOutcome stop_reason = EkiOutcome::kStop, braking_for = EkiOutcome::kStop;
  double line_speed = 0.0, line_travel = 0.0;
  std::vector<double> latch;
  std::uint32_t latch_id = 0;

  // inputs and the operator
  std::deque<std::pair<TimePoint, bool>> edges;
  bool input_level = false;
  std::optional<std::vector<double>> input_edge;
  bool program_runs = false, drives_on = true, e_stop = false, stop_message = false;
  bool start_held = true;
  EkiMode mode = EkiMode::kAut;
  int override_percent = 100;
  std::uint32_t fault = 0;
};

EkiController::EkiController(EkiControllerConfig config)
    : impl_(std::make_unique<Impl>(std::move(config))) {}
EkiController::~EkiController() = default;

void EkiController::tick(TimePoint now) { impl_->tick(now, muted_, deaf_, forgetful_); }
Duration EkiController::cycle() const { return std::chrono::milliseconds(impl_->config.cycle_ms); }

void EkiController::input(TimePoint t, bool closed) {
  if (input_broken_) return;
  // Through the filter, and then to the next look at it.
  const double since_epoch = std::chrono::duration<double>(t.time_since_epoch()).count();
  const double filtered = since_epoch + impl_->config.input_delay_s;
  const double sample = impl_->config.input_sample_s;
  const double seen = sample > 0.0 ? std::ceil(filtered / sample) * sample : filtered;
  impl_->edges.emplace_back(
      t + std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seen - since_epoch)),
      closed);
}

bool EkiController::connect() { return impl_->channel.connect(); }
void EkiController::disconnect() { impl_->channel.disconnect(); }
bool EkiController::connected() const { return impl_->channel.connected(); }
void EkiController::receive(std::string_view bytes) { impl_->channel.receive(bytes); }
std::string EkiController::take_output() { return impl_->channel.take_output(); }

void EkiController::start_program() {
  impl_->program_runs = true;
  impl_->stop_message = false;
  impl_->fault = 0;
}

void EkiController::cancel_program() {
  impl_->program_runs = false;
  impl_->abort_motion();
}

void EkiController::emergency_stop(bool pressed) {
  impl_->e_stop = pressed;
  if (!pressed) return;
  impl_->stop_message = true;
  cancel_program();
}

void EkiController::drives(bool on) {
  impl_->drives_on = on;
  if (!on) cancel_program();
}

void EkiController::mode(drivers::EkiMode mode) {
  // Turning the key switch stops and cancels whatever runs.
  if (mode != impl_->mode) cancel_program();
  impl_->mode = mode;
}

void EkiController::start_key(bool held) { impl_->start_held = held; }
void EkiController::set_override(int percent) {
  impl_->override_percent = std::clamp(percent, 0, 100);
}

void EkiController::place(const std::vector<double>& pose_rad) {
  if (!impl_->arm.at_rest() || pose_rad.size() != impl_->axes) {
    throw std::invalid_argument("emulated EKI controller: place() at rest, one angle per axis");
  }
  impl_->arm.place(pose_rad);
}

std::vector<double> EkiController::actual_rad_at(TimePoint t) const {
  return impl_->arm.actual_at(t);
}
std::vector<double> EkiController::setpoint_rad() const { return impl_->arm.setpoint(); }
bool EkiController::moving() const { return impl_->phase != Impl::Phase::kIdle; }
bool EkiController::ready() const { return impl_->is_ready(); }
std::uint32_t EkiController::session() const { return impl_->session; }
std::uint64_t EkiController::moves() const { return impl_->moves; }
const EkiChannel& EkiController::channel() const { return impl_->channel; }

}  // namespace cellcal::sim
