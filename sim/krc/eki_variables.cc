// System variables of the emulated EKI controller, and routines that its programs do not contain.

#include <algorithm>
#include <span>

#include "drivers/units.h"
#include "sim/krc/eki_controller.h"

namespace cellcal::sim {

using krl::Value;

namespace {

void clear_all(Value& value) {
  for (Value& part : value.parts) part.set_whole(0);
}

}  // namespace

drivers::EkiFrameValues EkiController::frame(drivers::EkiFrameKind kind, int number) {
  const bool tool = kind == drivers::EkiFrameKind::kTool;
  const auto& parts =
      system(tool ? "TOOL_DATA" : "BASE_DATA").parts.at(static_cast<std::size_t>(number) - 1).parts;
  drivers::EkiFrameValues values{};
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = parts[i].r;
  return values;
}

std::vector<double> EkiController::measured() {
  if (measurement_) return *measurement_;
  measurement_ = arm_.actual_at(now_);
  std::normal_distribution<double> noise(0.0, config_.noise_sigma_deg * drivers::kRadPerDeg);
  if (config_.noise_sigma_deg > 0.0)
    for (double& value : *measurement_) value += noise(random_);
  return *measurement_;
}

/// After a cold start no program has set them.
bool EkiController::has_frames() {
  return system("$TOOL").parts[0].given && system("$BASE").parts[0].given;
}

void EkiController::set_axes(Value& value, const std::vector<double>& rad) const {
  for (std::size_t i = 0; i < value.parts.size(); ++i) {
    const std::size_t axis = wire_.at_place(i);
    value.parts[i].set(i < axes_ ? wire_.shown(axis, rad[axis]) : 0.0);
  }
}

/// E1 to E6 of a position, from those of the axes.
void EkiController::set_external(Value& position, const std::vector<double>& rad) const {
  for (std::size_t place = drivers::kArmAxes; place < 2 * drivers::kArmAxes; ++place) {
    const std::size_t axis = wire_.at_place(place);
    position.parts[place + 2].set(place < axes_ ? wire_.shown(axis, rad[axis]) : 0.0);
  }
}

/// Variables that are computed when read.
void EkiController::bind_state() {
  const auto show = [this](const char* name, std::function<std::int32_t()> value) {
    program_.variable(name).read = [value](Value& to, std::size_t) { to.set_whole(value()); };
  };
  show("$T1", [this] { return mode_ == OperatingMode::kT1; });
  show("$T2", [this] { return mode_ == OperatingMode::kT2; });
  show("$AUT", [this] { return mode_ == OperatingMode::kAut; });
  show("$EXT", [this] { return mode_ == OperatingMode::kExt; });
  show("$PERI_RDY", [this] { return drives_on_; });
  show("$ALARM_STOP", [this] { return !e_stop_; });
  show("$STOPMESS", [this] { return stop_message_; });
  show("$OV_PRO", [this] { return override_percent_; });
  show("$PRO_STATE1", [this] { return static_cast<std::int32_t>(program_state()); });
  program_.variable("$PRO_NAME1").read = [this](Value& to, std::size_t) {
    to.set_text(selected_.empty() ? " " : selected_);
  };
  program_.variable("$FLAG").read = [this](Value& to, std::size_t at) {
    if (channel_.config().alive_flag == static_cast<int>(at) + 1)
      to.parts[at].set_whole(channel_.connected());
  };
  program_.variable("$OUT").read = [this](Value& to, std::size_t at) {
    for (std::size_t i = 1; i < wiring_.request_output.size(); ++i)
      if (wiring_.request_output[i] == static_cast<int>(at) + 1)
        to.parts[at].set_whole(static_cast<std::size_t>(request_) == i);
  };
  program_.variable("$IN").read = [this](Value& to, std::size_t at) {
    if (wiring_.input != static_cast<int>(at) + 1) return;
    // A contact shorter than the cycle of interrupts is still an edge for them.
    const bool closed = input_level_ || (interrupting_ && pulse_);
    to.parts[at].set_whole(closed == wiring_.contact_is_on);
  };
}

void EkiController::bind_variables() {
  for (const char* name : {"$IN", "$OUT", "$FLAG"}) clear_all(system(name));
  constexpr double kNone = 1e6;
  for (std::size_t i = 0; i < 12; ++i) {
    const std::size_t axis = wire_.at_place(i);
    const auto limit = [&](const std::vector<double>& all, double otherwise) {
      return axis < all.size() ? wire_.shown(axis, all[axis]) : otherwise;
    };
    system("$SOFTN_END").parts[i].set(limit(config_.soft_min_rad, -kNone));
    system("$SOFTP_END").parts[i].set(limit(config_.soft_max_rad, kNone));
  }
  for (const char* name : {"$VEL_AXIS", "$ACC_AXIS", "$VEL_EXTAX", "$ACC_EXTAX"})
    for (Value& part : system(name).parts) part.set_whole(100);
  const auto frames = [&](const char* name, const std::vector<drivers::EkiFrameValues>& values) {
    for (std::size_t i = 0; i < values.size(); ++i)
      for (std::size_t k = 0; k < 6; ++k) system(name).parts.at(i).parts[k].set(values[i][k]);
    program_.variable(name).set = [this](const Value&, std::size_t) { ++frames_set_; };
  };
  frames("TOOL_DATA", config_.tool_data);
  frames("BASE_DATA", config_.base_data);
  system("LOAD_DATA").set_all(0.0);
  program_.variable("$AXIS_ACT_MEAS").read = [this](Value& value, std::size_t) {
    set_axes(value, measured());
  };
  program_.variable("$AXIS_ACT").read = [this](Value& value, std::size_t) {
    set_axes(value, arm_.setpoint());
  };
  program_.variable("$AXIS_INT").read = [this](Value& value, std::size_t) {
    set_axes(value, input_edge_.value_or(measured()));
  };
  program_.variable("$POS_ACT").read = [this](Value& value, std::size_t) {
    if (!has_frames()) throw krl::RunError("$POS_ACT is invalid without $TOOL and $BASE");
    const KukaFrame frame =
        config_.states ? config_.states->frame(arm_.setpoint()) : frame_of(arm_.setpoint());
    for (std::size_t i = 0; i < 6; ++i) value.parts[i].set(frame[i]);
    set_external(value, arm_.setpoint());
  };
}

std::int64_t EkiController::timer_ms() const {
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now_.time_since_epoch());
  return ms.count() - ms.count() % std::max(1, config_.timer_ms);
}

void EkiController::bind_timers() {
  const auto current = [this](std::size_t at) {
    const Timer& timer = timers_[at];
    const std::int64_t value = timer.value + (timer.stopped ? 0 : timer_ms() - timer.since);
    // Beyond the range of an INT it begins anew.
    return value > INT32_MAX ? value & INT32_MAX : value;
  };
  program_.variable("$TIMER").read = [current](Value& value, std::size_t at) {
    value.parts[at].set_whole(static_cast<std::int32_t>(current(at)));
  };
  program_.variable("$TIMER").set = [this](const Value& value, std::size_t at) {
    timers_[at].value = value.parts[at].i;
    timers_[at].since = timer_ms();
  };
  program_.variable("$TIMER_FLAG").read = [current](Value& value, std::size_t at) {
    value.parts[at].set_whole(current(at) > 0);
  };
  program_.variable("$TIMER_STOP").set = [this, current](const Value& value, std::size_t at) {
    timers_[at].value = current(at);
    timers_[at].since = timer_ms();
    timers_[at].stopped = value.parts[at].truth();
  };
}

void EkiController::bind_kinematics() {
  program_.bind("FORWARD", [this](std::span<Value* const> a) {
    std::vector<double> rad(axes_);
    for (std::size_t i = 0; i < axes_; ++i) rad[i] = wire_.inside(i, a[0]->parts[wire_.place(i)].r);
    Value result(program_.type("E6POS"));
    const KukaFrame frame = frame_of(rad);
    for (std::size_t i = 0; i < 6; ++i) result.parts[i].set(frame[i]);
    set_external(result, rad);
    a[1]->set_whole(0);
    return result;
  });
  program_.bind("VARSTATE", [this](std::span<Value* const> a) {
    Value result(program_.type("VAR_STATE"));
    result.set_whole(a[0]->text() != "$POS_ACT" ? 3 : has_frames() ? 2 : 1);
    return result;
  });
  program_.bind("CWRITE", [this](std::span<Value* const> a) {
    write_command(a[3]->text());
    return Value();
  });
}

void EkiController::write_command(const std::string& command) {
  if (command == "STOP 1") {
    stop_program();
  } else if (command == "CANCEL 1") {
    cancel();
  } else if (command == "RUN/R1/CELLCAL_EKI()" && mode_ == OperatingMode::kExt &&
             state_ == ProgramState::kFree) {
    start("CELLCAL_EKI");
  }
}

// ---- EthernetKRL

krl::Value EkiController::status(std::size_t waiting, bool failed) const {
  Value result(program_.type("EKI_STATUS"));
  result.part("BUFF").set_whole(static_cast<std::int32_t>(waiting));
  result.part("MSG_NO").set_whole(failed ? 9 : 0);
  result.part("CONNECTED").set_whole(channel_.connected());
  return result;
}

krl::Value EkiController::take(const Value& path, Value& into, const char* kind) {
  const auto value = channel_.get(path.text());
  if (!value) return status(0, true);
  into.set(*value);
  // The fault of a robot program that does not answer: a move is received as a heartbeat.
  constexpr double kMove = 3.0, kBeat = 2.0;
  if (forgetful_ && path.text().ends_with(kind) && *value == kMove) into.set(kBeat);
  return status(0, false);
}

void EkiController::bind_channel() {
  using Arguments = std::span<Value* const>;
  const auto bind = [this](const char* name, std::function<Value(Arguments)> function) {
    program_.bind(name, std::move(function));
  };
  bind("EKI_INIT", [this](Arguments) { return channel_.init(), status(0, false); });
  bind("EKI_OPEN", [this](Arguments) {
    reopen_at_ = now_ + std::chrono::milliseconds(config_.reopen_ms);
    return status(0, false);
  });
  bind("EKI_CLEAR", [this](Arguments) {
    config_.clears_on_reconnect ? channel_.clear() : channel_.close();
    return status(0, false);
  });
  bind("EKI_CLEARBUFFER", [this](Arguments) { return channel_.empty_queues(), status(0, false); });
  bind("EKI_CHECKBUFFER", [this](Arguments a) {
    return status(deaf_ ? 0 : channel_.waiting(a[1]->text()), !channel_.exists());
  });
  for (const char* name : {"EKI_GETINT", "EKI_GETREAL"})
    bind(name, [this](Arguments a) { return take(*a[1], *a[2], "/@Type"); });
  bind("EKI_SETINT", [this](Arguments a) {
    return channel_.set(a[1]->text(), std::to_string(a[2]->i)), status(0, false);
  });
  bind("EKI_SETREAL", [this](Arguments a) {
    return channel_.set(a[1]->text(), eki_real(a[2]->r)), status(0, false);
  });
  bind("EKI_SEND", [this](Arguments a) {
    if (!muted_) channel_.send(a[1]->text());
    return status(0, false);
  });
}

}  // namespace cellcal::sim
