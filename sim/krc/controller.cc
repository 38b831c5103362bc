#include "sim/krc/controller.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

#include "drivers/kuka/rsi_codec.h"

namespace cellcal::sim {
namespace {

constexpr double kDegPerRad = 180.0 / std::numbers::pi;
constexpr double kRadPerDeg = std::numbers::pi / 180.0;

using drivers::kMaxAxes;

}  // namespace

struct Controller::Impl {
  explicit Impl(ControllerConfig c) : config(std::move(c)), random(config.seed) {
    axes = config.start_rad.size();
    if (axes == 0 || axes > kMaxAxes) {
      throw std::invalid_argument("emulated controller: 1 to 12 axes");
    }
    if (config.cycle_ms <= 0 || !(config.lag_s > 0.0)) {
      throw std::invalid_argument("emulated controller: cycle_ms and lag_s must be positive");
    }
    if (!config.max_speed_rad_s.empty() && config.max_speed_rad_s.size() != axes) {
      throw std::invalid_argument("emulated controller: max_speed_rad_s needs one value per axis");
    }
    if (config.ipoc_step == 0) config.ipoc_step = config.cycle_ms;
    base = setpoint = actual = config.start_rad;
    correction_deg.assign(axes, 0.0);
    accepted_deg = correction_deg;
    ipoc = config.ipoc_start;
  }

  void rsi_on() {
    base = setpoint = actual;
    correction_deg.assign(axes, 0.0);
    accepted_deg = correction_deg;
    late = late_in_a_row = packets = 0;
    awaiting = answered = stop_seen = false;
    first_frame = config.first_frame_only_ipoc;
    message.clear();
    phase = RsiPhase::kRunning;
  }

  // Where the arm is at `t`, from `actual` at `tick_at` towards the setpoint in force.
  std::vector<double> at(drivers::TimePoint t) const {
    const double dt = std::max(0.0, std::chrono::duration<double>(t - tick_at).count());
    const double moved = blocked ? 0.0 : -std::expm1(-dt / config.lag_s);
    std::vector<double> position = actual;
    for (std::size_t i = 0; i < axes; ++i) position[i] += moved * (setpoint[i] - actual[i]);
    return position;
  }

  void end(RsiPhase why, std::string text) {
    phase = why;
    message = std::move(text);
    setpoint = actual;
  }

  // The reply to the last packet: in time, late, or the last straw.
  void close_cycle() {
    if (!awaiting) return;
    awaiting = false;
    if (answered) {
      late_in_a_row = 0;
      return;
    }
    ++late;
    ++late_ever;
    ++late_in_a_row;
    if (!config.hold_on) accepted_deg.assign(axes, 0.0);
    const std::uint64_t counted = config.timeout_counts_total ? late : late_in_a_row;
    if (counted > static_cast<std::uint64_t>(config.timeout_cycles)) {
      end(RsiPhase::kFaulted,
          "KSS29002 Signal flow (running): Object ETHERNET1 returns error RSITimeout");
    }
  }

  // The correction accepted last comes into force.
  void apply() {
    for (std::size_t i = 0; i < axes; ++i) {
      if (std::abs(accepted_deg[i]) > config.monitor_deg) {
        end(RsiPhase::kFaulted, "KSS29000 AXISCORRMON: Permissible overall correction exceeded, A" +
                                    std::to_string(i + 1));
        return;
      }
      correction_deg[i] = std::clamp(accepted_deg[i], -config.clamp_deg, config.clamp_deg);
      const double next = base[i] + correction_deg[i] * kRadPerDeg;
      const double speed = std::abs(next - setpoint[i]) / (1e-3 * config.cycle_ms);
      if (!config.max_speed_rad_s.empty() && speed > config.max_speed_rad_s[i]) {
        end(RsiPhase::kFaulted, "Command velocity A" + std::to_string(i + 1));
        return;
      }
      setpoint[i] = next;
    }
  }

  std::string_view packet() {
    std::array<double, kMaxAxes> actual_deg{}, base_deg{};
    std::normal_distribution<double> noise(0.0, 1.0);
    for (std::size_t i = 0; i < axes; ++i) {
      actual_deg[i] = actual[i] * kDegPerRad;
      if (config.noise_sigma_deg > 0.0) actual_deg[i] += config.noise_sigma_deg * noise(random);
      base_deg[i] = base[i] * kDegPerRad;
    }
    drivers::RobFields fields;
    fields.ipoc = ipoc;
    fields.decimals = config.precision;
    if (first_frame) {
      fields.with_cartesian = false;
    } else {
      fields.axes_deg = std::span(actual_deg).first(axes);
      if (config.send_setpoint) fields.setpoint_axes_deg = std::span(base_deg).first(axes);
      if (config.send_delay) fields.delay = static_cast<std::uint32_t>(late);
    }
    first_frame = false;
    return drivers::format_rob(fields, buffer);
  }

  std::string_view tick(drivers::TimePoint now) {
    if (ticked) actual = at(now);
    ticked = true;
    tick_at = now;
    // The counter is the controller's, not the session's: it goes on whatever RSI does.
    ipoc += static_cast<std::uint64_t>(config.ipoc_step);
    if (phase != RsiPhase::kRunning) return {};
    close_cycle();
    if (phase == RsiPhase::kRunning && stop_seen)
      end(RsiPhase::kEnded, "RSI_MOVECORR ended (STOP)");
    if (phase == RsiPhase::kRunning) apply();
    if (phase != RsiPhase::kRunning) return {};
    awaiting = true;
    answered = false;
    ++packets;
    return packet();
  }

  void receive(std::string_view reply) {
    if (phase != RsiPhase::kRunning || !awaiting) return;
    const drivers::SenNames names{config.sentype, config.axis_tag, "EK", config.stop_tag};
    if (parser.parse_sen(reply, names, frame) != drivers::WireError::kNone) return;
    // A wrong SENTYPE or IPOC is discarded without a word, as the real one does.
    if (frame.type.view() != config.sentype || frame.ipoc.text.view() != std::to_string(ipoc)) {
      return;
    }
    answered = true;
    for (std::size_t i = 0; i < axes; ++i) {
      const auto& source = i < 6 ? frame.axes_deg : frame.external_deg;
      const std::size_t at_index = i < 6 ? i : i - 6;
      if (at_index < source.size()) accepted_deg[i] = source[at_index];
    }
    if (frame.stop) {
      // STOP acts on the rising edge.
      if (*frame.stop == 1 && !stop_level) stop_seen = true;
      stop_level = *frame.stop == 1;
    }
  }

  ControllerConfig config;
  std::size_t axes = 0;
  std::mt19937_64 random;
  drivers::RsiParser parser;
  drivers::SenFrame frame;
  std::array<char, drivers::kRsiBuffer> buffer{};

  RsiPhase phase = RsiPhase::kBeforeRsiOn;
  std::string message;
  std::vector<double> base, setpoint, actual;
  std::vector<double> correction_deg, accepted_deg;
  drivers::TimePoint tick_at{};
  bool ticked = false, blocked = false;
  bool awaiting = false, answered = false, stop_seen = false, stop_level = false;
  bool first_frame = false;
  std::uint64_t ipoc = 0, late = 0, late_ever = 0, late_in_a_row = 0, packets = 0;
};

Controller::Controller(ControllerConfig config)
    : impl_(std::make_unique<Impl>(std::move(config))) {}
Controller::~Controller() = default;

void Controller::rsi_on() { impl_->rsi_on(); }
std::string_view Controller::tick(drivers::TimePoint now) { return impl_->tick(now); }
void Controller::receive(std::string_view reply) { impl_->receive(reply); }

std::vector<double> Controller::actual_rad_at(drivers::TimePoint t) const { return impl_->at(t); }
std::vector<double> Controller::setpoint_rad() const { return impl_->setpoint; }
std::vector<double> Controller::correction_deg() const { return impl_->correction_deg; }

RsiPhase Controller::phase() const { return impl_->phase; }
const std::string& Controller::message() const { return impl_->message; }
std::uint64_t Controller::late() const { return impl_->late; }
std::uint64_t Controller::late_ever() const { return impl_->late_ever; }
std::uint64_t Controller::packets() const { return impl_->packets; }
std::uint64_t Controller::ipoc() const { return impl_->ipoc; }
drivers::Duration Controller::cycle() const {
  return std::chrono::milliseconds(impl_->config.cycle_ms);
}

void Controller::block_drives(bool blocked) { impl_->blocked = blocked; }

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
