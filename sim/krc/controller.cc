#include "sim/krc/controller.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <random>
#include <stdexcept>

#include "drivers/kuka/wire/wire_axes.h"
#include "drivers/units.h"
#include "sim/krc/rsi_program.h"

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

struct Controller::Impl {
  explicit Impl(ControllerConfig c)
      : config(std::move(c)),
        channel(config.effective_channel()),
        program(config.program),
        random(config.seed) {
    axes = config.start_rad.size();
    if (axes == 0 || axes > kMaxAxes) {
      throw std::invalid_argument("emulated controller: 1 to 12 axes");
    }
    if (config.cycle_ms <= 0 || !(config.lag_s > 0.0)) {
      throw std::invalid_argument("emulated controller: cycle_ms and lag_s must be positive");
    }
    if (config.linear_unit && axes <= drivers::kArmAxes)
      throw std::invalid_argument("emulated controller: a linear unit carries an arm of six axes");
    wire = {axes, config.linear_unit};
    check_size(config.max_speed_rad_s, axes, "max_speed_rad_s");
    check_size(config.max_acceleration_rad_s2, axes, "max_acceleration_rad_s2");
    check_size(config.soft_min_rad, axes, "soft_min_rad");
    check_size(config.soft_max_rad, axes, "soft_max_rad");
    if (config.ipoc_step == 0) config.ipoc_step = config.cycle_ms;
    ipoc = config.ipoc_start;
    actual = config.start_rad;
    begin_at_actual();
  }

  void begin_at_actual() {
    base = setpoint = actual;
    axis_deg.assign(axes, 0.0);
    speed_rad_s.assign(axes, 0.0);
    frame.fill(0.0);
    inputs.assign(channel.receive.size(), 0.0);
  }

  void rsi_on() {
    begin_at_actual();
    late = late_in_a_row = packets = taken = 0;
    awaiting = answered = stop_seen = stop_level = halted = false;
    first_frame = config.first_frame_only_ipoc;
    message.clear();
    phase = RsiPhase::kRunning;
    if (e_stop) return end(RsiPhase::kFaulted, "EMERGENCY STOP is pressed");
    if (!drives_on) return end(RsiPhase::kFaulted, "Drives are off");
    if (manual() && !start_held) return end(RsiPhase::kFaulted, "Start key is not held");
    start_program();
  }

  // To RSI_MOVECORR, or to a HALT before RSI_ON.
  void start_program() {
    RsiStart start;
    for (std::size_t place = 0; place < axes; ++place) {
      start.high_deg.push_back(limit_at(place, config.clamp_deg, config.clamp_external));
      start.low_deg.push_back(-start.high_deg.back());
    }
    if (!program.start(on_wire(actual), on_wire(config.soft_min_rad), on_wire(config.soft_max_rad),
                       start))
      return end(RsiPhase::kFaulted, program.message());
    low_deg = start.low_deg;
    high_deg = start.high_deg;
    if (start.relative) config.mode = *start.relative ? RsiMode::kRelative : RsiMode::kAbsolute;
  }

  /// In the wire's order and units.
  std::vector<double> on_wire(const std::vector<double>& values) const {
    std::vector<double> shown(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) shown[wire.place(i)] = wire.shown(i, values[i]);
    return shown;
  }

  bool manual() const { return mode == OperatingMode::kT1 || mode == OperatingMode::kT2; }

  void stop_running(const char* why) {
    if (phase == RsiPhase::kRunning) end(RsiPhase::kFaulted, why);
  }

  // Position at `t`, from `actual` at `tick_at` towards the current setpoint.
  std::vector<double> at(drivers::TimePoint t) const {
    const double dt = std::max(0.0, std::chrono::duration<double>(t - tick_at).count());
    const double moved = blocked ? 0.0 : -std::expm1(-dt / config.lag_s);
    std::vector<double> position = actual;
    for (std::size_t i = 0; i < axes; ++i) position[i] += moved * (setpoint[i] - actual[i]);
    if (slide_per_s) position[sliding] = actual[sliding] + *slide_per_s * dt;
    return position;
  }

  void end(RsiPhase why, std::string words) {
    phase = why;
    message = std::move(words);
    setpoint = actual;
  }

  // Evaluates the reply to the last packet: in time, late, or the time-out.
  void close_cycle() {
    if (!awaiting) return;
    awaiting = false;
    if (answered) {
      late_in_a_row = 0;
      ++taken;
      ++taken_ever;
      return;
    }
    ++late;
    if (taken > 0) ++late_ever;
    ++late_in_a_row;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      if (channel.receive[i].hold_on) continue;
      inputs[i] = 0.0;
      if (channel.receive[i].role == RsiRole::kStop) stop_level = false;
    }
    const std::uint64_t counted = config.timeout_counts_total ? late : late_in_a_row;
    if (counted > static_cast<std::uint64_t>(config.timeout_cycles)) {
      end(RsiPhase::kFaulted,
          "KSS29002 Signal flow (running): Object ETHERNET1 returns error RSITimeout");
    }
  }

  // Outputs of the ETHERNET object, through AXISCORR and POSCORR, which clamp without a message.
  void correct() {
    const bool relative = config.mode == RsiMode::kRelative;
    KukaFrame wanted = frame;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      const RsiReceived& from = channel.receive[i];
      const std::size_t axis = from.index + (from.role == RsiRole::kExternal ? 6 : 0);
      const bool of_axis = from.role == RsiRole::kAxis || from.role == RsiRole::kExternal;
      if (of_axis && axis < axes) {
        const double whole = inputs[i] + (relative ? axis_deg[axis] : 0.0);
        axis_deg[axis] = std::clamp(whole, low_deg[axis], high_deg[axis]);
      } else if (from.role == RsiRole::kCartesian) {
        const double whole = inputs[i] + (relative ? wanted[from.index] : 0.0);
        const double limit = from.index < 3 ? config.clamp_mm : HUGE_VAL;
        wanted[from.index] = std::clamp(whole, -limit, limit);
      }
    }
    // MaxRotAngle applies to the total rotation: a value beyond it is ignored.
    const bool beyond = turn_deg(wanted) > config.clamp_turn_deg;
    std::copy_n(wanted.begin(), beyond ? 3 : wanted.size(), frame.begin());
  }

  std::string monitors() const {
    for (std::size_t i = 0; i < axes; ++i) {
      if (std::abs(axis_deg[i]) > limit_at(i, config.monitor_deg, config.monitor_external))
        return "KSS29000 AXISCORRMON: Permissible overall correction exceeded, " +
               axis_name(wire, wire.at_place(i));
    }
    const double shift = std::hypot(frame[0], frame[1], frame[2]);
    if (shift > config.monitor_mm || turn_deg(frame) > config.monitor_turn_deg)
      return "KSS29000 POSCORRMON: Permissible overall correction exceeded";
    return {};
  }

  std::optional<std::vector<double>> corrected() const {
    const bool cartesian = std::any_of(frame.begin(), frame.end(), [](double v) { return v != 0; });
    if (cartesian) {
      if (!config.arm) return std::nullopt;
      return config.arm->corrected(base, frame, config.cartesian_system, setpoint);
    }
    std::vector<double> next = base;
    for (std::size_t i = 0; i < axes; ++i) next[i] += wire.inside(i, axis_deg[wire.place(i)]);
    return next;
  }

  // Fault of the motion system for the next setpoint; empty: none.
  std::string objection(const std::vector<double>& next, const std::vector<double>& speed) const {
    const double dt = 1e-3 * config.cycle_ms;
    for (std::size_t i = 0; i < axes; ++i) {
      if ((i < config.soft_min_rad.size() && next[i] < config.soft_min_rad[i]) ||
          (i < config.soft_max_rad.size() && next[i] > config.soft_max_rad[i]))
        return "Software limit switch " + axis_name(wire, i);
      if (i < config.max_speed_rad_s.size() && std::abs(speed[i]) > config.max_speed_rad_s[i])
        return "Command velocity " + axis_name(wire, i);
      if (i < config.max_acceleration_rad_s2.size() &&
          std::abs(speed[i] - speed_rad_s[i]) / dt > config.max_acceleration_rad_s2[i])
        return "Command gear torque " + axis_name(wire, i);
      if (mode == OperatingMode::kT1 && !config.arm && !config.max_speed_rad_s.empty() &&
          std::abs(speed[i]) > kT1Share * config.max_speed_rad_s[i])
        return "T1: speed of " + axis_name(wire, i) + " too high";
    }
    if (mode == OperatingMode::kT1 && config.arm) {
      const KukaFrame from = config.arm->frame(setpoint), to = config.arm->frame(next);
      if (std::hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]) / dt > kT1MmS)
        return "T1: more than 250 mm/s at the TCP";
    }
    return {};
  }

  // The current correction becomes the setpoint of this cycle.
  void apply() {
    correct();
    if (halted) return;
    std::string fault = monitors();
    if (!fault.empty()) return end(RsiPhase::kFaulted, fault);
    const auto next = corrected();
    if (!next) {
      return end(RsiPhase::kFaulted, config.arm ? "Work envelope exceeded"
                                                : "POSCORR: no geometry of the arm is known");
    }
    std::vector<double> speed(axes);
    for (std::size_t i = 0; i < axes; ++i)
      speed[i] = ((*next)[i] - setpoint[i]) / (1e-3 * config.cycle_ms);
    fault = objection(*next, speed);
    if (!fault.empty()) return end(RsiPhase::kFaulted, fault);
    setpoint = *next;
    speed_rad_s = speed;
  }

  void apply_stop() {
    if (!stop_seen) return;
    stop_seen = false;
    if (config.stop_mode == RsiStop::kExitMoveCorr) {
      program.finish();
      return end(RsiPhase::kEnded, "RSI_MOVECORR ended (STOP)");
    }
    message = "STOP object, mode " + std::to_string(static_cast<int>(config.stop_mode));
    if (config.stop_mode == RsiStop::kInfo) return;
    halted = true;
    setpoint = actual;
  }

  std::string packet() {
    if (first_frame) {
      first_frame = false;
      return format_first_packet(ipoc);
    }
    std::array<double, kMaxAxes> actual_deg{}, base_deg{};
    std::normal_distribution<double> noise(0.0, 1.0);
    for (std::size_t i = 0; i < axes; ++i) {
      double& shown = actual_deg[wire.place(i)];
      shown = wire.shown(i, actual[i]);
      if (config.noise_sigma_deg > 0.0) shown += config.noise_sigma_deg * noise(random);
      base_deg[wire.place(i)] = wire.shown(i, base[i]);
    }
    RsiValues values;
    values.ipoc = ipoc;
    values.delay = late;
    values.mode = static_cast<int>(mode);  // as KRL numbers MODE_OP
    values.override_percent = override_percent;
    values.input_on = input_on;
    values.actual_deg = std::span(actual_deg).first(axes);
    values.setpoint_deg = std::span(base_deg).first(axes);
    if (const auto& model = config.states ? config.states : config.arm) {
      values.actual_frame = model->frame(actual);
      values.setpoint_frame = model->frame(base);
    }
    return format_packet(channel, values, config.precision);
  }

  std::string_view tick(drivers::TimePoint now) {
    if (ticked) actual = at(now);
    ticked = true;
    tick_at = now;
    // The counter belongs to the controller, not the session: it is independent of RSI's state.
    ipoc += static_cast<std::uint64_t>(config.ipoc_step);
    read_input(now);
    if (phase != RsiPhase::kRunning) return {};
    close_cycle();
    if (phase == RsiPhase::kRunning) apply_stop();
    if (phase == RsiPhase::kRunning) apply();
    if (phase != RsiPhase::kRunning) return {};
    awaiting = !channel.only_send;
    answered = false;
    ++packets;
    text = packet();
    return text;
  }

  void read_input(drivers::TimePoint now) {
    for (; !edges.empty() && edges.front().first <= now; edges.pop_front())
      input_on = edges.front().second;
  }

  void receive(std::string_view bytes) {
    if (phase != RsiPhase::kRunning || !awaiting) return;
    const std::optional<RsiReply> reply = parse_reply(channel, bytes);
    // A wrong SENTYPE or IPOC is discarded without a message, as by the real controller.
    if (!reply || reply->type != channel.sentype || reply->ipoc != std::to_string(ipoc)) return;
    answered = true;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      if (!reply->values[i]) continue;
      inputs[i] = *reply->values[i];
      if (channel.receive[i].role != RsiRole::kStop) continue;
      // STOP acts on the rising edge.
      const bool level = inputs[i] != 0.0;
      stop_seen = stop_seen || (level && !stop_level);
      stop_level = level;
    }
  }

  ControllerConfig config;
  RsiChannelConfig channel;
  std::size_t axes = 0;
  drivers::WireAxes wire{0, false};
  RsiProgram program;
  std::mt19937_64 random;
  std::string text;

  RsiPhase phase = RsiPhase::kBeforeRsiOn;
  OperatingMode mode = OperatingMode::kAut;
  int override_percent = 100;
  std::string message;
  std::vector<double> base, setpoint, actual, speed_rad_s;
  std::vector<double> inputs;             // outputs of the ETHERNET object, one per received value
  std::vector<double> axis_deg;           // current corrections, in the wire's order
  std::vector<double> low_deg, high_deg;  // their limits
  KukaFrame frame{};
  drivers::TimePoint tick_at{};
  std::deque<std::pair<drivers::TimePoint, bool>> edges;  // future edges of the contact input
  bool input_on = false;
  std::size_t sliding = 0;
  std::optional<double> slide_per_s;
  bool ticked = false, blocked = false, halted = false;
  bool awaiting = false, answered = false, stop_seen = false, stop_level = false;
  bool first_frame = false, e_stop = false, drives_on = true, start_held = true;
  std::uint64_t ipoc = 0, late = 0, late_ever = 0, late_in_a_row = 0, packets = 0;
  std::uint64_t taken = 0, taken_ever = 0;
};

Controller::Controller(ControllerConfig config)
    : impl_(std::make_unique<Impl>(std::move(config))) {}
Controller::~Controller() = default;

void Controller::rsi_on() { impl_->rsi_on(); }
std::string_view Controller::tick(drivers::TimePoint now) { return impl_->tick(now); }
void Controller::receive(std::string_view reply) { impl_->receive(reply); }

std::vector<double> Controller::actual_rad_at(drivers::TimePoint t) const { return impl_->at(t); }
std::vector<double> Controller::setpoint_rad() const { return impl_->setpoint; }
std::vector<double> Controller::correction_deg() const { return impl_->axis_deg; }
const KukaFrame& Controller::cartesian_correction() const { return impl_->frame; }

RsiPhase Controller::phase() const { return impl_->phase; }
const std::string& Controller::message() const { return impl_->message; }
std::uint64_t Controller::late() const { return impl_->late; }
std::uint64_t Controller::late_ever() const { return impl_->late_ever; }
std::uint64_t Controller::taken_ever() const { return impl_->taken_ever; }
std::uint64_t Controller::packets() const { return impl_->packets; }
std::uint64_t Controller::ipoc() const { return impl_->ipoc; }
drivers::Duration Controller::cycle() const {
  return std::chrono::milliseconds(impl_->config.cycle_ms);
}

void Controller::emergency_stop(bool pressed) {
  impl_->e_stop = pressed;
  if (!pressed) return;
  if (!impl_->config.rsi_outlives_stop) return impl_->stop_running("EMERGENCY STOP");
  impl_->blocked = true;
}

void Controller::drives(bool on) {
  impl_->drives_on = on;
  if (!on) impl_->stop_running("Drives off");
}

void Controller::mode(OperatingMode mode) {
  if (mode != impl_->mode) impl_->stop_running("Operating mode changed");
  impl_->mode = mode;
}

void Controller::set_override(int percent) {
  impl_->override_percent = std::clamp(percent, 0, 100);
}

void Controller::start_key(bool held) {
  impl_->start_held = held;
  if (held && impl_->config.rsi_outlives_stop && !impl_->e_stop) impl_->blocked = false;
  if (!held && impl_->manual()) impl_->stop_running("Start key released");
}

void Controller::input(drivers::TimePoint t, bool on) { impl_->edges.emplace_back(t, on); }

void Controller::cancel_program() { impl_->stop_running("Program cancelled"); }

void Controller::block_drives(bool blocked) { impl_->blocked = blocked; }

void Controller::slide(std::size_t axis, std::optional<double> per_s) {
  impl_->sliding = axis;
  impl_->slide_per_s = per_s;
}

void Controller::place(const std::vector<double>& pose_rad) {
  if (impl_->phase == RsiPhase::kRunning) {
    throw std::logic_error("emulated controller: the arm cannot be placed while RSI runs");
  }
  if (pose_rad.size() != impl_->axes) {
    throw std::invalid_argument("emulated controller: pose with another number of axes");
  }
  impl_->base = impl_->setpoint = impl_->actual = pose_rad;
}

}  // namespace cellcal::sim
