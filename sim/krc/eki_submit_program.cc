// The submit interpreter: receives telegrams, sends states, dead man, connection.

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>

#include "drivers/units.h"
#include "sim/krc/eki_robot_program.h"

namespace cellcal::sim {

namespace {

using drivers::EkiProgress;
using drivers::EkiType;

using drivers::kDegPerRad;
using drivers::kRadPerDeg;
constexpr double kUsualFrameSpeed = 3.0;

std::string axis_path(std::string_view root, std::string_view first, std::string_view external,
                      std::size_t i) {
  const bool own = i < 6;
  return std::string(root) + '/' + std::string(own ? first : external) + "/@" + (own ? 'A' : 'E') +
         std::to_string(i % 6 + 1);
}

}  // namespace

std::string krl_real(double value) {
  // KRL's REAL is a 32-bit float; EKI writes six decimals.
  std::array<char, 64> buffer{};
  const auto end =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(),
                    static_cast<double>(static_cast<float>(value)), std::chars_format::fixed, 6);
  return {buffer.data(), end.ptr};
}

EkiPrograms::EkiPrograms(EkiControllerConfig c)
    : config(std::move(c)),
      channel(EkiChannelConfig::parse(config.channel_xml)),
      arm(config.start_rad, config.lag_s),
      random(config.seed) {
  if (channel.config().udp || channel.config().receive.empty() || channel.config().send.empty()) {
    throw std::invalid_argument(
        "EKI channel file: cellcal's programs need TCP, and elements to receive and to send");
  }
  axes = config.start_rad.size();
  if (axes == 0 || axes > drivers::kMaxAxes) {
    throw std::invalid_argument("emulated EKI controller: 1 to 12 axes");
  }
  if (config.cycle_ms <= 0 || config.interrupt_ms % config.cycle_ms != 0 ||
      config.state_ms % config.cycle_ms != 0 || config.idle_state_ms % config.cycle_ms != 0 ||
      !(config.lag_s > 0.0)) {
    throw std::invalid_argument(
        "emulated EKI controller: interrupt_ms, state_ms and idle_state_ms must be multiples of cycle_ms, lag_s "
        "positive");
  }
  if (config.max_speed_rad_s.empty()) config.max_speed_rad_s.assign(axes, kUsualFrameSpeed);
  if (config.max_speed_rad_s.size() != axes) {
    throw std::invalid_argument("emulated EKI controller: max_speed_rad_s needs one per axis");
  }
  latch = config.start_rad;
  has_frames = std::any_of(channel.config().receive.begin(), channel.config().receive.end(),
                           [](const auto& one) { return one.first == "RobotCommand/Frame/@Ask"; });
  channel.open();
}

std::optional<EkiPrograms::Telegram> EkiPrograms::on_telegram() {
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

void EkiPrograms::read_telegrams(TimePoint now, bool forgetful) {
  while (channel.waiting("RobotCommand/@Seq") > 0) {
    const auto telegram = on_telegram();
    if (!telegram) return;
    obey(*telegram, now, forgetful);
  }
}

void EkiPrograms::obey(const Telegram& t, TimePoint now, bool forgetful) {
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
      if (t.id <= last_id || busy) return;
      last_id = t.id;
      if (!forgetful) accept_move(t);
      break;
    case EkiType::kStop:
      if (t.id >= last_id) stop_motion();
      last_id = std::max(last_id, t.id);
      break;
    case EkiType::kBye:
      stop_motion();
      part();
      break;
    case EkiType::kRun:
      run_program();
      break;
    case EkiType::kHello:
    case EkiType::kBeat:
      break;
  }
}

void EkiPrograms::accept_move(const Telegram& t) {
  reported_id = t.id;
  fresh_session = false;
  outcome = EkiOutcome::kNone;
  order = t;
  if (!is_ready()) return finish(EkiOutcome::kAborted);
  stop_flag = false;
  stop_reason = EkiOutcome::kStop;
  busy = ordered = true;  // accepted by the robot program in its next cycle
}

void EkiPrograms::stop_motion() {
  if (busy) stop_flag = true;
}

void EkiPrograms::watch(TimePoint now) {
  if (busy && timer_ran_out(now) && !stop_flag) {
    stop_flag = true;
    stop_reason = EkiOutcome::kDeadMan;
  }
  // Interrupts are processed only once the motion continues: the program is cancelled instead.
  const bool held = stop_flag && program_state() == ProgramState::kStop;
  if (busy && (!drives_on || e_stop || stop_message || held)) ending = true;
  end_program();
}

void EkiPrograms::end_program() {
  if (gone()) {
    ready = ordered = ending = false;
    if (busy) finish(EkiOutcome::kAborted);
    return;
  }
  if (!ending) return;
  stop_reason = EkiOutcome::kAborted;
  stop_flag = true;
  ready = false;
  if (program_state() == ProgramState::kActive) {
    stop_program();
  } else {
    cancel();
  }
}

void EkiPrograms::watch_connection(TimePoint now) {
  if (channel.connected()) {
    was_connected = true;
    return;
  }
  if (was_connected) {
    was_connected = false;
    stop_motion();
    part();
    frame_waits = false;
    frame_answer = {};
    if (config.clears_on_reconnect) {
      channel.clear();
    } else {
      channel.close();
    }
    reopen_at = now + std::chrono::milliseconds(config.reopen_ms);
  }
  if (!reopen_at || now < *reopen_at) return;
  reopen_at.reset();
  open_channel();
}

void EkiPrograms::open_channel() {
  channel.init();
  channel.open();
}

void EkiPrograms::time_pass(TimePoint now) {
  const auto since = std::chrono::duration_cast<std::chrono::milliseconds>(now - pass_at).count();
  const std::int64_t steps = since - since % std::max(1, config.timer_ms);
  if (session != 0) pass_ms = std::max<std::int64_t>(pass_ms, steps);
  pass_at = now;
}

void EkiPrograms::examine_channel() {
  if (++looks < config.poll_interval_ms / config.state_ms) return;
  looks = 0;
  if (!channel.exists()) open_channel();
}

std::vector<double> EkiPrograms::noisy(std::vector<double> rad) {
  std::normal_distribution<double> noise(0.0, config.noise_sigma_deg * kRadPerDeg);
  if (config.noise_sigma_deg > 0.0) {
    for (double& value : rad) value += noise(random);
  }
  return rad;
}

void EkiPrograms::send_state(TimePoint now) {
  const auto put = [&](const char* path, std::uint64_t value) {
    channel.set(path, std::to_string(value));
  };
  const auto flag = [&](const char* path, bool value) { put(path, value ? 1 : 0); };
  const std::vector<double> at = noisy(arm.actual_at(now));
  for (std::size_t i = 0; i < axes; ++i) {
    channel.set(axis_path("RobotState", "Axis", "Ext", i), krl_real(at[i] * kDegPerRad));
    channel.set(axis_path("RobotState", "Latch", "LatchExt", i), krl_real(latch[i] * kDegPerRad));
  }
  put("RobotState/@Session", session);
  put("RobotState/@Heard", heard);
  const auto ms =
      std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()).count();
  constexpr std::uint64_t kLargestInt = 0x7FFFFFFF;
  put("RobotState/@Time",
      static_cast<std::uint64_t>(ms - ms % std::max(1, config.timer_ms)) & kLargestInt);
  const EkiProgress progress = busy               ? EkiProgress::kMoving
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
  put("RobotState/Status/@Pass", static_cast<std::uint64_t>(std::exchange(pass_ms, 0)));
  put("RobotState/Status/@Request", static_cast<std::uint64_t>(request));
  if (has_frames) send_frame();
  channel.send("RobotState");
}

}  // namespace cellcal::sim
