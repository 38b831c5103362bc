#include "sim/krc/controller.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "drivers/units.h"

namespace cellcal::sim {
namespace {

using drivers::kDegPerRad;
using drivers::kRadPerDeg;
constexpr double kT1MmS = 250.0;
// 250 mm/s at the flange, as a share of an axis' full speed on an arm of 1.4 m.
constexpr double kT1Share = 0.06;

using drivers::kMaxAxes;

std::string axis_name(const drivers::WireAxes& wire, std::size_t axis) {
  const std::size_t i = wire.place(axis);
  return i < 6 ? "A" + std::to_string(i + 1) : "E" + std::to_string(i - 5);
}

void check_size(const std::vector<double>& values, std::size_t axes, const char* key) {
  if (values.empty() || values.size() == axes) return;
  throw std::invalid_argument(std::string("emulated controller: ") + key +
                              " needs one value per axis");
}

/// Limit of the axis at that place on the wire: of the arm, or of an external axis.
double limit_at(std::size_t place, double of_arm, const std::vector<double>& external) {
  constexpr double kWide = 5000.0;
  if (place < drivers::kArmAxes) return of_arm;
  const std::size_t i = place - drivers::kArmAxes;
  return i < external.size() ? external[i] : kWide;
}

/// Total rotation angle of A, B and C: that of Rz(A) Ry(B) Rx(C), by its quaternion.
double turn_deg(const KukaFrame& frame) {
  const auto half = [&](std::size_t i) { return frame[i] * kRadPerDeg / 2.0; };
  const double w = std::cos(half(3)) * std::cos(half(4)) * std::cos(half(5)) +
                   std::sin(half(3)) * std::sin(half(4)) * std::sin(half(5));
  return 2.0 * std::acos(std::clamp(std::abs(w), 0.0, 1.0)) * kDegPerRad;
}

}  // namespace

RsiChannelConfig ControllerConfig::effective_channel() const {
  if (channel) return *channel;
  RsiChannelConfig made;
  made.sentype = sentype;
  const bool external = start_rad.size() > 6;
  const auto send = [&](const char* name, RsiSource source) {
    made.send.push_back({name, source, {}});
  };
  send("RIst", RsiSource::kActualFrame);
  if (send_cartesian_setpoint) send("RSol", RsiSource::kSetpointFrame);
  send("AIPos", RsiSource::kActualAxes);
  if (external) send("EIPos", RsiSource::kActualExternal);
  if (send_setpoint) send("ASPos", RsiSource::kSetpointAxes);
  if (send_setpoint && external) send("ESPos", RsiSource::kSetpointExternal);
  if (send_delay) send("Delay", RsiSource::kDelay);
  if (!mode_tag.empty()) add_sent_value(mode_tag, {}, RsiSentValue::Of::kMode, made.send);
  if (!override_tag.empty())
    add_sent_value(override_tag, {}, RsiSentValue::Of::kOverride, made.send);
  if (!contact_tag.empty()) add_sent_value(contact_tag, {}, RsiSentValue::Of::kInput, made.send);
  const auto receive = [&](const std::string& element, std::string_view names, RsiRole role) {
    for (std::size_t i = 0; i < 6; ++i) {
      const std::string name =
          names.size() == 6 ? std::string{names[i]} : std::string(names) + std::to_string(i + 1);
      made.receive.push_back({element, name, role, i, hold_on, true});
    }
  };
  receive(axis_tag, "A", RsiRole::kAxis);
  receive(external_axis_tag, "E", RsiRole::kExternal);
  receive(cartesian_tag, "XYZABC", RsiRole::kCartesian);
  if (!stop_tag.empty()) made.receive.push_back({stop_tag, "", RsiRole::kStop, 0, false, true});
  return made;
}

Controller::Controller(ControllerConfig c)
    : config_(std::move(c)),
      channel_(config_.effective_channel()),
      program_(config_.program),
      random_(config_.seed) {
  axes_ = config_.start_rad.size();
  if (axes_ == 0 || axes_ > kMaxAxes) {
    throw std::invalid_argument("emulated controller: 1 to 12 axes");
  }
  if (config_.cycle_ms <= 0 || !(config_.lag_s > 0.0)) {
    throw std::invalid_argument("emulated controller: cycle_ms and lag_s must be positive");
  }
  if (config_.linear_unit && axes_ <= drivers::kArmAxes)
    throw std::invalid_argument("emulated controller: a linear unit carries an arm of six axes");
  wire_ = {axes_, config_.linear_unit};
  check_size(config_.max_speed_rad_s, axes_, "max_speed_rad_s");
  check_size(config_.max_acceleration_rad_s2, axes_, "max_acceleration_rad_s2");
  check_size(config_.soft_min_rad, axes_, "soft_min_rad");
  check_size(config_.soft_max_rad, axes_, "soft_max_rad");
  if (config_.ipoc_step == 0) config_.ipoc_step = config_.cycle_ms;
  ipoc_ = config_.ipoc_start;
  actual_ = config_.start_rad;
  begin_at_actual();
}

void Controller::begin_at_actual() {
  base_ = setpoint_ = actual_;
  axis_deg_.assign(axes_, 0.0);
  speed_rad_s_.assign(axes_, 0.0);
  frame_.fill(0.0);
  inputs_.assign(channel_.receive.size(), 0.0);
}

void Controller::rsi_on() {
  begin_at_actual();
  late_ = late_in_a_row_ = packets_ = taken_ = 0;
  awaiting_ = answered_ = stop_seen_ = stop_level_ = halted_ = false;
  first_frame_ = config_.first_frame_only_ipoc;
  message_.clear();
  phase_ = RsiPhase::kRunning;
  if (e_stop_) return end(RsiPhase::kFaulted, "EMERGENCY STOP is pressed");
  if (!drives_on_) return end(RsiPhase::kFaulted, "Drives are off");
  if (manual() && !start_held_) return end(RsiPhase::kFaulted, "Start key is not held");
  start_program();
}

// To RSI_MOVECORR, or to a HALT before RSI_ON.
void Controller::start_program() {
  RsiStart start;
  for (std::size_t place = 0; place < axes_; ++place) {
    start.high_deg.push_back(limit_at(place, config_.clamp_deg, config_.clamp_external));
    start.low_deg.push_back(-start.high_deg.back());
  }
  if (!program_.start(on_wire(actual_), on_wire(config_.soft_min_rad),
                      on_wire(config_.soft_max_rad), start))
    return end(RsiPhase::kFaulted, program_.message());
  low_deg_ = start.low_deg;
  high_deg_ = start.high_deg;
  if (start.relative) config_.mode = *start.relative ? RsiMode::kRelative : RsiMode::kAbsolute;
}

/// In the wire's order and units.
std::vector<double> Controller::on_wire(const std::vector<double>& values) const {
  std::vector<double> shown(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) shown[wire_.place(i)] = wire_.shown(i, values[i]);
  return shown;
}

void Controller::stop_running(const char* why) {
  if (phase_ == RsiPhase::kRunning) end(RsiPhase::kFaulted, why);
}

// Position at `t`, from `actual` at `tick_at` towards the current setpoint.
std::vector<double> Controller::actual_rad_at(drivers::TimePoint t) const {
  const double dt = std::max(0.0, std::chrono::duration<double>(t - tick_at_).count());
  const double moved = blocked_ ? 0.0 : -std::expm1(-dt / config_.lag_s);
  std::vector<double> position = actual_;
  for (std::size_t i = 0; i < axes_; ++i) position[i] += moved * (setpoint_[i] - actual_[i]);
  if (slide_per_s_) position[sliding_] = actual_[sliding_] + *slide_per_s_ * dt;
  return position;
}

void Controller::end(RsiPhase why, std::string words) {
  phase_ = why;
  message_ = std::move(words);
  setpoint_ = actual_;
}

// Evaluates the reply to the last packet: in time, late, or the time-out.
void Controller::close_cycle() {
  if (!awaiting_) return;
  awaiting_ = false;
  if (answered_) {
    late_in_a_row_ = 0;
    ++taken_;
    ++taken_ever_;
    return;
  }
  ++late_;
  if (taken_ > 0) ++late_ever_;
  ++late_in_a_row_;
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    if (channel_.receive[i].hold_on) continue;
    inputs_[i] = 0.0;
    if (channel_.receive[i].role == RsiRole::kStop) stop_level_ = false;
  }
  const std::uint64_t counted = config_.timeout_counts_total ? late_ : late_in_a_row_;
  if (counted > static_cast<std::uint64_t>(config_.timeout_cycles)) {
    end(RsiPhase::kFaulted,
        "KSS29002 Signal flow (running): Object ETHERNET1 returns error RSITimeout");
  }
}

// Outputs of the ETHERNET object, through AXISCORR and POSCORR, which clamp without a message.
void Controller::correct() {
  const bool relative = config_.mode == RsiMode::kRelative;
  KukaFrame wanted = frame_;
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    const RsiReceived& from = channel_.receive[i];
    const std::size_t axis = from.index + (from.role == RsiRole::kExternal ? 6 : 0);
    const bool of_axis = from.role == RsiRole::kAxis || from.role == RsiRole::kExternal;
    if (of_axis && axis < axes_) {
      const double whole = inputs_[i] + (relative ? axis_deg_[axis] : 0.0);
      axis_deg_[axis] = std::clamp(whole, low_deg_[axis], high_deg_[axis]);
    } else if (from.role == RsiRole::kCartesian) {
      const double whole = inputs_[i] + (relative ? wanted[from.index] : 0.0);
      const double limit = from.index < 3 ? config_.clamp_mm : HUGE_VAL;
      wanted[from.index] = std::clamp(whole, -limit, limit);
    }
  }
  // MaxRotAngle applies to the total rotation: a value beyond it is ignored.
  const bool beyond = turn_deg(wanted) > config_.clamp_turn_deg;
  std::copy_n(wanted.begin(), beyond ? 3 : wanted.size(), frame_.begin());
}

std::string Controller::monitors() const {
  for (std::size_t i = 0; i < axes_; ++i) {
    if (std::abs(axis_deg_[i]) > limit_at(i, config_.monitor_deg, config_.monitor_external))
      return "KSS29000 AXISCORRMON: Permissible overall correction exceeded, " +
             axis_name(wire_, wire_.at_place(i));
  }
  const double shift = std::hypot(frame_[0], frame_[1], frame_[2]);
  if (shift > config_.monitor_mm || turn_deg(frame_) > config_.monitor_turn_deg)
    return "KSS29000 POSCORRMON: Permissible overall correction exceeded";
  return {};
}

std::optional<std::vector<double>> Controller::corrected() const {
  const bool cartesian = std::any_of(frame_.begin(), frame_.end(), [](double v) { return v != 0; });
  if (cartesian) {
    if (!config_.arm) return std::nullopt;
    return config_.arm->corrected(base_, frame_, config_.cartesian_system, setpoint_);
  }
  std::vector<double> next = base_;
  for (std::size_t i = 0; i < axes_; ++i) next[i] += wire_.inside(i, axis_deg_[wire_.place(i)]);
  return next;
}

// Fault of the motion system for the next setpoint; empty: none.
std::string Controller::objection(const std::vector<double>& next,
                                  const std::vector<double>& speed) const {
  const double dt = 1e-3 * config_.cycle_ms;
  for (std::size_t i = 0; i < axes_; ++i) {
    if ((i < config_.soft_min_rad.size() && next[i] < config_.soft_min_rad[i]) ||
        (i < config_.soft_max_rad.size() && next[i] > config_.soft_max_rad[i]))
      return "Software limit switch " + axis_name(wire_, i);
    if (i < config_.max_speed_rad_s.size() && std::abs(speed[i]) > config_.max_speed_rad_s[i])
      return "Command velocity " + axis_name(wire_, i);
    if (i < config_.max_acceleration_rad_s2.size() &&
        std::abs(speed[i] - speed_rad_s_[i]) / dt > config_.max_acceleration_rad_s2[i])
      return "Command gear torque " + axis_name(wire_, i);
    if (mode_ == OperatingMode::kT1 && !config_.arm && !config_.max_speed_rad_s.empty() &&
        std::abs(speed[i]) > kT1Share * config_.max_speed_rad_s[i])
      return "T1: speed of " + axis_name(wire_, i) + " too high";
  }
  if (mode_ == OperatingMode::kT1 && config_.arm) {
    const KukaFrame from = config_.arm->frame(setpoint_), to = config_.arm->frame(next);
    if (std::hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]) / dt > kT1MmS)
      return "T1: more than 250 mm/s at the TCP";
  }
  return {};
}

// The current correction becomes the setpoint of this cycle.
void Controller::apply() {
  correct();
  if (halted_) return;
  std::string fault = monitors();
  if (!fault.empty()) return end(RsiPhase::kFaulted, fault);
  const auto next = corrected();
  if (!next) {
    return end(RsiPhase::kFaulted,
               config_.arm ? "Work envelope exceeded" : "POSCORR: no geometry of the arm is known");
  }
  std::vector<double> speed(axes_);
  for (std::size_t i = 0; i < axes_; ++i)
    speed[i] = ((*next)[i] - setpoint_[i]) / (1e-3 * config_.cycle_ms);
  fault = objection(*next, speed);
  if (!fault.empty()) return end(RsiPhase::kFaulted, fault);
  setpoint_ = *next;
  speed_rad_s_ = speed;
}

void Controller::apply_stop() {
  if (!stop_seen_) return;
  stop_seen_ = false;
  if (config_.stop_mode == RsiStop::kExitMoveCorr) {
    program_.finish();
    return end(RsiPhase::kEnded, "RSI_MOVECORR ended (STOP)");
  }
  message_ = "STOP object, mode " + std::to_string(static_cast<int>(config_.stop_mode));
  if (config_.stop_mode == RsiStop::kInfo) return;
  halted_ = true;
  setpoint_ = actual_;
}

std::string Controller::packet() {
  if (first_frame_) {
    first_frame_ = false;
    return format_first_packet(ipoc_);
  }
  std::array<double, kMaxAxes> actual_deg{}, base_deg{};
  std::normal_distribution<double> noise(0.0, 1.0);
  for (std::size_t i = 0; i < axes_; ++i) {
    double& shown = actual_deg[wire_.place(i)];
    shown = wire_.shown(i, actual_[i]);
    if (config_.noise_sigma_deg > 0.0) shown += config_.noise_sigma_deg * noise(random_);
    base_deg[wire_.place(i)] = wire_.shown(i, base_[i]);
  }
  RsiValues values;
  values.ipoc = ipoc_;
  values.delay = late_;
  values.mode = static_cast<int>(mode_);  // as KRL numbers MODE_OP
  values.override_percent = override_percent_;
  values.input_on = input_on_;
  values.actual_deg = std::span(actual_deg).first(axes_);
  values.setpoint_deg = std::span(base_deg).first(axes_);
  if (const auto& model = config_.states ? config_.states : config_.arm) {
    values.actual_frame = model->frame(actual_);
    values.setpoint_frame = model->frame(base_);
  }
  return format_packet(channel_, values, config_.precision);
}

std::string_view Controller::tick(drivers::TimePoint now) {
  if (ticked_) actual_ = actual_rad_at(now);
  ticked_ = true;
  tick_at_ = now;
  // The counter belongs to the controller, not the session: it is independent of RSI's state.
  ipoc_ += static_cast<std::uint64_t>(config_.ipoc_step);
  read_input(now);
  if (phase_ != RsiPhase::kRunning) return {};
  close_cycle();
  if (phase_ == RsiPhase::kRunning) apply_stop();
  if (phase_ == RsiPhase::kRunning) apply();
  if (phase_ != RsiPhase::kRunning) return {};
  awaiting_ = !channel_.only_send;
  answered_ = false;
  ++packets_;
  text_ = packet();
  return text_;
}

void Controller::read_input(drivers::TimePoint now) {
  for (; !edges_.empty() && edges_.front().first <= now; edges_.pop_front())
    input_on_ = edges_.front().second;
}

void Controller::receive(std::string_view bytes) {
  if (phase_ != RsiPhase::kRunning || !awaiting_) return;
  const std::optional<RsiReply> reply = parse_reply(channel_, bytes);
  // A wrong SENTYPE or IPOC is discarded without a message, as by the real controller.
  if (!reply || reply->type != channel_.sentype || reply->ipoc != std::to_string(ipoc_)) return;
  answered_ = true;
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    if (!reply->values[i]) continue;
    inputs_[i] = *reply->values[i];
    if (channel_.receive[i].role != RsiRole::kStop) continue;
    // STOP acts on the rising edge.
    const bool level = inputs_[i] != 0.0;
    stop_seen_ = stop_seen_ || (level && !stop_level_);
    stop_level_ = level;
  }
}

void Controller::emergency_stop(bool pressed) {
  e_stop_ = pressed;
  if (!pressed) return;
  if (!config_.rsi_outlives_stop) return stop_running("EMERGENCY STOP");
  blocked_ = true;
}

void Controller::drives(bool on) {
  drives_on_ = on;
  if (!on) stop_running("Drives off");
}

void Controller::mode(OperatingMode mode) {
  if (mode != mode_) stop_running("Operating mode changed");
  mode_ = mode;
}

void Controller::set_override(int percent) { override_percent_ = std::clamp(percent, 0, 100); }

void Controller::start_key(bool held) {
  start_held_ = held;
  if (held && config_.rsi_outlives_stop && !e_stop_) blocked_ = false;
  if (!held && manual()) stop_running("Start key released");
}

void Controller::place(const std::vector<double>& pose_rad) {
  if (phase_ == RsiPhase::kRunning) {
    throw std::logic_error("emulated controller: the arm cannot be placed while RSI runs");
  }
  if (pose_rad.size() != axes_) {
    throw std::invalid_argument("emulated controller: pose with another number of axes");
  }
  base_ = setpoint_ = actual_ = pose_rad;
}

}  // namespace cellcal::sim
