#include "sim/krc/eki_machine.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>

#include "calib/export/krl_text.h"
#include "drivers/units.h"

namespace cellcal::sim {

namespace {

using drivers::kDegPerRad;
using drivers::kRadPerDeg;
using krl::Value;

// 250 mm/s at the flange, as a share of an axis' full speed on an arm of 1.4 m.
constexpr double kT1PtpShare = 0.06;
// Deceleration of a safety stop, harder than BRAKE F: relative to PTP's acceleration.
constexpr double kSafetyFactor = 4.0;
constexpr double kUsualFrameSpeed = 3.0;

/// Other programs: a caller of CELLCAL_EKI, as CELL, and one without a motion.
constexpr const char* kCell = R"(DEF CELL ( )
  LOOP
    WAIT FOR CELL_CALLS
    CELL_CALLS=FALSE
    CELLCAL_EKI ( )
  ENDLOOP
END
)";
constexpr const char* kOther = "DEF OTHER ( )\nWAIT FOR FALSE\nEND\n";

constexpr const char* kVariables = R"(
STRUC EKI_STATUS INT BUFF,READ,MSG_NO,BOOL CONNECTED,INT COUNTER
BOOL CELL_CALLS=FALSE
INT $CMD=1
CHAR $PRO_NAME1[24]
PRO_STATE $PRO_STATE1=#P_FREE
BOOL $T1,$T2,$AUT,$EXT,$PERI_RDY,$ALARM_STOP,$STOPMESS
INT $OV_PRO
BOOL $IN[8192],$OUT[8192],$FLAG[1024]
INT $TIMER[64]
BOOL $TIMER_STOP[64],$TIMER_FLAG[64]
E6AXIS $AXIS_ACT_MEAS,$AXIS_ACT,$AXIS_INT
E6POS $POS_ACT
REAL $SOFTN_END[12],$SOFTP_END[12]
INT $VEL_AXIS[6],$ACC_AXIS[6],$VEL_EXTAX[6],$ACC_EXTAX[6]
CP $VEL,$ACC
FRAME $TOOL,$BASE
LOAD $LOAD
IPO_MODE $IPO_MODE
ORI_TYPE $ORI_TYPE
DATE $DATE={CSEC 0,SEC 0,MIN 0,HOUR 12,DAY 1,MONTH 1,YEAR 2026}
FRAME TOOL_DATA[16],BASE_DATA[32]
LOAD LOAD_DATA[16]
ENUM VAR_STATE DECLARED,INITIALIZED,UNKNOWN
EXTFCT VAR_STATE VARSTATE(CHAR[] :IN)
EXTFCT E6POS FORWARD(E6AXIS :IN,INT :OUT)
EXTFCT E6AXIS INVERSE(E6POS :IN,E6AXIS :IN,INT :OUT)
EXT CWRITE(INT :IN,STATE_T :OUT,MODUS_T :IN,CHAR[] :IN)
EXTFCT EKI_STATUS EKI_INIT(CHAR[] :IN)
EXTFCT EKI_STATUS EKI_OPEN(CHAR[] :IN)
EXTFCT EKI_STATUS EKI_CLEAR(CHAR[] :IN)
EXTFCT EKI_STATUS EKI_CLEARBUFFER(CHAR[] :IN,CHAR[] :IN)
EXTFCT EKI_STATUS EKI_CHECKBUFFER(CHAR[] :IN,CHAR[] :IN)
EXTFCT EKI_STATUS EKI_GETINT(CHAR[] :IN,CHAR[] :IN,INT :OUT)
EXTFCT EKI_STATUS EKI_GETREAL(CHAR[] :IN,CHAR[] :IN,REAL :OUT)
EXTFCT EKI_STATUS EKI_SETINT(CHAR[] :IN,CHAR[] :IN,INT :IN)
EXTFCT EKI_STATUS EKI_SETREAL(CHAR[] :IN,CHAR[] :IN,REAL :IN)
EXTFCT EKI_STATUS EKI_SEND(CHAR[] :IN,CHAR[] :IN)
)";

EkiControllerConfig::Files modules_of(const EkiControllerConfig::Files& files) {
  EkiControllerConfig::Files modules = {{"cell.src", kCell}, {"other.src", kOther}};
  for (const auto& [name, text] : files)
    if (name.ends_with(".src") || name.ends_with(".sub") || name.ends_with(".dat"))
      modules[name] = text;
  return modules;
}

const std::string& channel_of(const EkiControllerConfig::Files& files) {
  for (const auto& [name, text] : files)
    if (name.ends_with(".xml")) return text;
  throw std::invalid_argument("emulated EKI controller: its files have no channel (.xml)");
}

/// In EKI's format of a REAL: a 32-bit float with six decimals.
std::string krl_real(float value) {
  std::array<char, 64> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(),
                                 static_cast<double>(value), std::chars_format::fixed, 6);
  return {buffer.data(), end.ptr};
}

void clear_all(Value& value) {
  for (Value& part : value.parts) part.set_whole(0);
}

/// The number in $IN[n] or $OUT[n]; 0: the line has none.
int subscript_of(const calib::krl::Line& line, std::string_view variable) {
  const auto& tokens = line.tokens;
  for (std::size_t i = 0; i + 2 < tokens.size(); ++i)
    if (tokens[i].is(variable)) return static_cast<int>(tokens[i + 2].value);
  return 0;
}

}  // namespace

EkiWiring wiring_of(const EkiControllerConfig::Files& files) {
  EkiWiring wiring;
  for (const auto& [name, text] : modules_of(files)) {
    int output = 0;
    for (const calib::krl::Line& line : calib::krl::read_lines({name, text})) {
      const auto& first = line.tokens[0];
      const int input = first.is("INTERRUPT") ? subscript_of(line, "$IN") : 0;
      if (input > 0) {
        wiring.input = input;
        wiring.contact_is_on = std::any_of(line.tokens.begin(), line.tokens.end(),
                                           [](const auto& token) { return token.is("TRUE"); });
      }
      if (first.is("ASKED") && output > 0)
        wiring.request_output.at(static_cast<std::size_t>(line.tokens[2].value)) = output;
      output = first.is("IF") ? subscript_of(line, "$OUT") : 0;
    }
  }
  return wiring;
}

EkiMachine::EkiMachine(EkiControllerConfig c)
    : config(std::move(c)),
      wiring(wiring_of(config.files)),
      channel(EkiChannelConfig::parse(channel_of(config.files))),
      arm(config.start_rad, config.lag_s),
      program(modules_of(config.files), kVariables),
      robot(program, this),
      submit(program),
      random(config.seed) {
  if (channel.config().udp || channel.config().receive.empty() || channel.config().send.empty()) {
    throw std::invalid_argument(
        "EKI channel file: cellcal's programs need TCP, and elements to receive and to send");
  }
  axes = config.start_rad.size();
  if (axes == 0 || axes > drivers::kMaxAxes) {
    throw std::invalid_argument("emulated EKI controller: 1 to 12 axes");
  }
  if (config.linear_unit && axes <= drivers::kArmAxes)
    throw std::invalid_argument(
        "emulated EKI controller: a linear unit carries an arm of six axes");
  wire = {axes, config.linear_unit};
  if (config.cycle_ms <= 0 || config.interrupt_ms % config.cycle_ms != 0 || !(config.lag_s > 0.0)) {
    throw std::invalid_argument(
        "emulated EKI controller: interrupt_ms must be a multiple of cycle_ms, lag_s positive");
  }
  if (config.max_speed_rad_s.empty()) config.max_speed_rad_s.assign(axes, kUsualFrameSpeed);
  if (config.max_speed_rad_s.size() != axes) {
    throw std::invalid_argument("emulated EKI controller: max_speed_rad_s needs one per axis");
  }
  bind_state();
  bind_variables();
  bind_timers();
  bind_channel();
  bind_kinematics();
  channel.open();
  submit.select("CELLCAL_LOOP");
}

// ---- the cycle

void EkiMachine::tick(TimePoint at, const Faults& with) {
  now = at;
  faults = with;
  measurement.reset();
  read_input_edges();
  scale_speed();
  const double seconds = std::chrono::duration<double>(now.time_since_epoch()).count();
  // It has run since power on, before any program was selected.
  if (cycles == 0) submit.run(seconds);
  if (program_state() == ProgramState::kActive && !stopping) {
    if (cycles % static_cast<std::uint64_t>(config.interrupt_ms / config.cycle_ms) == 0) {
      interrupting = true;
      robot.poll_interrupts();
      interrupting = pulse = false;
    }
    robot.run(seconds);
    if (robot.state() == krl::Interpreter::State::kEnded) state = ProgramState::kEnd;
    if (robot.state() == krl::Interpreter::State::kFailed) stop_message = true, stop_program();
    if (robot.state() == krl::Interpreter::State::kHalted) stop_program();
  }
  arm.tick(now, 1e-3 * config.cycle_ms);
  settle();
  if (reopen_at && now >= *reopen_at) {
    reopen_at.reset();
    channel.open();
  }
  if (!faults.submit_halted) submit.run(seconds);
  ++cycles;
}

void EkiMachine::read_input_edges() {
  while (!edges.empty() && edges.front().first <= now) {
    const auto [at, closed] = edges.front();
    edges.pop_front();
    if (closed && !input_level) {
      pulse = true;
      if (!input_edge) {
        measurement.reset();
        input_edge = config.latches_setpoint ? arm.setpoint() : arm.actual_at(at);
      }
    }
    input_level = closed;
  }
}

// ---- the selected program

EkiMachine::ProgramState EkiMachine::program_state() const {
  const bool released = manual() && !start_held;
  return state == ProgramState::kActive && released ? ProgramState::kStop : state;
}

void EkiMachine::start(const char* name) {
  stop_message = false;
  if (state == ProgramState::kActive && selected == name) return;  // it runs, or still brakes
  const bool failed = robot.state() == krl::Interpreter::State::kFailed;
  if (state == ProgramState::kStop && selected == name && !failed) {
    state = ProgramState::kActive;
    robot.go_on();
    if (phase == Phase::kHeld) go();
    return;
  }
  selected = name;
  state = ProgramState::kActive;
  stopping = cancelling = false;
  phase = Phase::kIdle;
  robot.select(name);
}

void EkiMachine::stop_program() {
  if (state != ProgramState::kActive) return;
  stopping = true;
  if (moving()) arm.brake(kSafetyFactor * axes_acceleration);
  settle();
}

bool EkiMachine::cancel() {
  if (program_state() == ProgramState::kActive) return false;
  state = ProgramState::kFree;
  selected.clear();
  robot.cancel();
  stopping = cancelling = false;
  if (arm.at_rest()) {
    phase = Phase::kIdle;
    return true;
  }
  arm.brake(kSafetyFactor * axes_acceleration);
  phase = Phase::kDropped;
  return true;
}

void EkiMachine::settle() {
  if (!arm.at_rest() && (moving() || phase == Phase::kDropped)) return;
  if (phase == Phase::kDropped) phase = Phase::kIdle;
  if (phase == Phase::kBraking) phase = Phase::kBraked;
  if (stopping) {
    stopping = false;
    state = ProgramState::kStop;
    if (phase == Phase::kMoving) phase = Phase::kHeld;
    if (cancelling) cancel();
    return;
  }
  if (phase == Phase::kMoving) phase = Phase::kIdle;
}

int EkiMachine::asked(const char* function) {
  krl::Interpreter question(program);
  question.select(std::string("CELLCAL_SUB:") + function);
  question.run(0.0);
  return question.result() ? question.result()->i : 0;
}

void EkiMachine::write_command(const std::string& command) {
  if (command == "STOP 1") {
    stop_program();
  } else if (command == "CANCEL 1") {
    cancel();
  } else if (command == "RUN/R1/CELLCAL_EKI()" && mode == OperatingMode::kExt &&
             state == ProgramState::kFree) {
    start("CELLCAL_EKI");
  }
}

// ---- motion

KukaFrame EkiMachine::frame_of(const std::vector<double>& rad) const {
  if (config.arm) return config.arm->frame(rad);
  // Without geometry each axis is 1 m from the TCP.
  KukaFrame frame{};
  for (std::size_t i = 0; i < std::min<std::size_t>(6, axes); ++i)
    frame[i] = rad[i] * (i < 3 ? 1000.0 : kDegPerRad);
  return frame;
}

std::vector<double> EkiMachine::target_of(const krl::Motion& motion) const {
  const Value& to = motion.target;
  if (motion.kind == krl::Motion::Kind::kPtpRel || motion.kind == krl::Motion::Kind::kLinRel)
    throw krl::RunError("relative motions are not modelled");
  std::vector<double> rad = arm.setpoint();
  const bool axial = to.type->index_of("A1") == 0;
  KukaFrame frame = frame_of(rad);
  for (std::size_t i = 0; i < to.parts.size(); ++i) {
    const std::string& name = to.type->names[i];
    if (!to.parts[i].given || name == "S" || name == "T") continue;
    const std::size_t number = name.size() > 1 ? static_cast<std::size_t>(name[1] - '1') : 0;
    const std::size_t place = number + (name[0] == 'E' ? drivers::kArmAxes : 0);
    if (!axial && i < 6) {
      frame[i] = to.parts[i].r;
    } else if (place < axes) {
      const std::size_t axis = wire.at_place(place);
      rad[axis] = wire.inside(axis, to.parts[i].r);
    }
  }
  if (axial) return rad;
  if (config.arm) {
    const auto found = config.arm->axes(frame, rad);
    if (!found) throw krl::RunError("work envelope exceeded");
    std::copy(found->begin(), found->end(), rad.begin());
    return rad;
  }
  for (std::size_t i = 0; i < std::min<std::size_t>(6, axes); ++i)
    rad[i] = frame[i] / (i < 3 ? 1000.0 : kDegPerRad);
  return rad;
}

double EkiMachine::path_m(const std::vector<double>& to) const {
  constexpr double kShortestM = 1e-6;
  const KukaFrame a = frame_of(arm.setpoint()), b = frame_of(to);
  return std::max(kShortestM, 1e-3 * std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]));
}

/// Speed of a LIN [1/s]: $VEL.CP along the path, $VEL.ORI1 for the rotation.
double EkiMachine::linear_speed(const std::vector<double>& to) const {
  const auto& velocity = const_cast<krl::Program&>(program)["$VEL"].parts;
  const KukaFrame a = frame_of(arm.setpoint()), b = frame_of(to);
  double turn = 0.0;
  for (std::size_t i = 3; i < 6; ++i)
    turn = std::max(turn, std::abs(std::remainder(b[i] - a[i], 360.0)));
  const double speed = velocity[0].r / path_m(to);
  return turn > 0.0 ? std::min(speed, velocity[1].r / turn) : speed;
}

void EkiMachine::move(const krl::Motion& motion) {
  target = target_of(motion);
  const bool lin = motion.kind == krl::Motion::Kind::kLin;
  double speed = 1e9, acceleration = 1e9, travel = 0.0;
  for (std::size_t i = 0; i < axes; ++i) {
    const double share = std::abs(target[i] - arm.setpoint()[i]);
    travel = std::max(travel, share);
    if (share <= 0.0) continue;
    const std::size_t place = wire.place(i);
    const Value& percent = system(place < 6 ? "$VEL_AXIS" : "$VEL_EXTAX").parts[place % 6];
    speed = std::min(speed, config.max_speed_rad_s[i] / share * (lin ? 1.0 : percent.i / 100.0));
    acceleration = std::min(acceleration, config.max_acceleration_rad_s2 / share);
  }
  if (travel <= 0.0) return;
  if (robot.is_in("CC_MOVE")) ++moves;
  line_travel = travel;
  line_speed = lin ? std::min(speed, linear_speed(target)) : speed;
  axes_acceleration = acceleration;
  line_acceleration =
      lin ? std::min(acceleration, system("$ACC").parts[0].r / path_m(target)) : acceleration;
  input_edge.reset();
  go();
}

void EkiMachine::go() {
  arm.go(target, line_speed, line_acceleration);
  phase = Phase::kMoving;
}

void EkiMachine::go_on() {
  if (phase == Phase::kBraked) go();
}

void EkiMachine::brake(bool fast) {
  if (phase != Phase::kMoving) return;
  arm.brake(fast ? config.fast_brake_factor * axes_acceleration : line_acceleration);
  phase = Phase::kBraking;
}

void EkiMachine::scale_speed() {
  double scale = override_percent / 100.0;
  if (mode == OperatingMode::kT1 && line_travel > 0.0) {
    const double limit = kT1PtpShare * *std::min_element(config.max_speed_rad_s.begin(),
                                                         config.max_speed_rad_s.end());
    scale = std::min(scale, limit / (line_speed * line_travel));
  }
  arm.scale(manual() && !start_held ? 0.0 : scale);
}

// ---- system variables

std::vector<double> EkiMachine::measured() {
  if (measurement) return *measurement;
  measurement = arm.actual_at(now);
  std::normal_distribution<double> noise(0.0, config.noise_sigma_deg * kRadPerDeg);
  if (config.noise_sigma_deg > 0.0)
    for (double& value : *measurement) value += noise(random);
  return *measurement;
}

/// After a cold start no program has set them.
bool EkiMachine::has_frames() {
  return system("$TOOL").parts[0].given && system("$BASE").parts[0].given;
}

void EkiMachine::set_axes(Value& value, const std::vector<double>& rad) const {
  for (std::size_t i = 0; i < value.parts.size(); ++i) {
    const std::size_t axis = wire.at_place(i);
    value.parts[i].set(i < axes ? wire.shown(axis, rad[axis]) : 0.0);
  }
}

/// E1 to E6 of a position, from those of the axes.
void EkiMachine::set_external(Value& position, const std::vector<double>& rad) const {
  for (std::size_t place = drivers::kArmAxes; place < 2 * drivers::kArmAxes; ++place) {
    const std::size_t axis = wire.at_place(place);
    position.parts[place + 2].set(place < axes ? wire.shown(axis, rad[axis]) : 0.0);
  }
}

/// Variables that are computed when read.
void EkiMachine::bind_state() {
  const auto show = [this](const char* name, std::function<std::int32_t()> value) {
    program.variable(name).read = [value](Value& to, std::size_t) { to.set_whole(value()); };
  };
  show("$T1", [this] { return mode == OperatingMode::kT1; });
  show("$T2", [this] { return mode == OperatingMode::kT2; });
  show("$AUT", [this] { return mode == OperatingMode::kAut; });
  show("$EXT", [this] { return mode == OperatingMode::kExt; });
  show("$PERI_RDY", [this] { return drives_on; });
  show("$ALARM_STOP", [this] { return !e_stop; });
  show("$STOPMESS", [this] { return stop_message; });
  show("$OV_PRO", [this] { return override_percent; });
  show("$PRO_STATE1", [this] { return static_cast<std::int32_t>(program_state()); });
  program.variable("$PRO_NAME1").read = [this](Value& to, std::size_t) {
    to.set_text(selected.empty() ? " " : selected);
  };
  program.variable("$FLAG").read = [this](Value& to, std::size_t at) {
    if (channel.config().alive_flag == static_cast<int>(at) + 1)
      to.parts[at].set_whole(channel.connected());
  };
  program.variable("$OUT").read = [this](Value& to, std::size_t at) {
    for (std::size_t i = 1; i < wiring.request_output.size(); ++i)
      if (wiring.request_output[i] == static_cast<int>(at) + 1)
        to.parts[at].set_whole(static_cast<std::size_t>(request) == i);
  };
  program.variable("$IN").read = [this](Value& to, std::size_t at) {
    if (wiring.input != static_cast<int>(at) + 1) return;
    // A contact shorter than the cycle of interrupts is still an edge for them.
    const bool closed = input_level || (interrupting && pulse);
    to.parts[at].set_whole(closed == wiring.contact_is_on);
  };
}

void EkiMachine::bind_variables() {
  for (const char* name : {"$IN", "$OUT", "$FLAG"}) clear_all(system(name));
  constexpr double kNone = 1e6;
  for (std::size_t i = 0; i < 12; ++i) {
    const std::size_t axis = wire.at_place(i);
    const auto limit = [&](const std::vector<double>& all, double otherwise) {
      return axis < all.size() ? wire.shown(axis, all[axis]) : otherwise;
    };
    system("$SOFTN_END").parts[i].set(limit(config.soft_min_rad, -kNone));
    system("$SOFTP_END").parts[i].set(limit(config.soft_max_rad, kNone));
  }
  for (const char* name : {"$VEL_AXIS", "$ACC_AXIS", "$VEL_EXTAX", "$ACC_EXTAX"})
    for (Value& part : system(name).parts) part.set_whole(100);
  const auto frames = [&](const char* name, const std::vector<drivers::EkiFrameValues>& values) {
    for (std::size_t i = 0; i < values.size(); ++i)
      for (std::size_t k = 0; k < 6; ++k) system(name).parts.at(i).parts[k].set(values[i][k]);
    program.variable(name).set = [this](const Value&, std::size_t) { ++frames_set; };
  };
  frames("TOOL_DATA", config.tool_data);
  frames("BASE_DATA", config.base_data);
  program.variable("$AXIS_ACT_MEAS").read = [this](Value& value, std::size_t) {
    set_axes(value, measured());
  };
  program.variable("$AXIS_ACT").read = [this](Value& value, std::size_t) {
    set_axes(value, arm.setpoint());
  };
  program.variable("$AXIS_INT").read = [this](Value& value, std::size_t) {
    set_axes(value, input_edge.value_or(measured()));
  };
  program.variable("$POS_ACT").read = [this](Value& value, std::size_t) {
    if (!has_frames()) throw krl::RunError("$POS_ACT is invalid without $TOOL and $BASE");
    const KukaFrame frame =
        config.states ? config.states->frame(arm.setpoint()) : frame_of(arm.setpoint());
    for (std::size_t i = 0; i < 6; ++i) value.parts[i].set(frame[i]);
    set_external(value, arm.setpoint());
  };
}

std::int64_t EkiMachine::timer_ms() const {
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch());
  return ms.count() - ms.count() % std::max(1, config.timer_ms);
}

void EkiMachine::bind_timers() {
  const auto current = [this](std::size_t at) {
    const Timer& timer = timers[at];
    const std::int64_t value = timer.value + (timer.stopped ? 0 : timer_ms() - timer.since);
    // Beyond the range of an INT it begins anew.
    return value > INT32_MAX ? value & INT32_MAX : value;
  };
  program.variable("$TIMER").read = [current](Value& value, std::size_t at) {
    value.parts[at].set_whole(static_cast<std::int32_t>(current(at)));
  };
  program.variable("$TIMER").set = [this](const Value& value, std::size_t at) {
    timers[at].value = value.parts[at].i;
    timers[at].since = timer_ms();
  };
  program.variable("$TIMER_FLAG").read = [current](Value& value, std::size_t at) {
    value.parts[at].set_whole(current(at) > 0);
  };
  program.variable("$TIMER_STOP").set = [this, current](const Value& value, std::size_t at) {
    timers[at].value = current(at);
    timers[at].since = timer_ms();
    timers[at].stopped = value.parts[at].truth();
  };
}

void EkiMachine::bind_kinematics() {
  program.bind("FORWARD", [this](std::span<Value* const> a) {
    std::vector<double> rad(axes);
    for (std::size_t i = 0; i < axes; ++i) rad[i] = wire.inside(i, a[0]->parts[wire.place(i)].r);
    Value result(program.type("E6POS"));
    const KukaFrame frame = frame_of(rad);
    for (std::size_t i = 0; i < 6; ++i) result.parts[i].set(frame[i]);
    set_external(result, rad);
    a[1]->set_whole(0);
    return result;
  });
  program.bind("VARSTATE", [this](std::span<Value* const> a) {
    Value result(program.type("VAR_STATE"));
    result.set_whole(a[0]->text() != "$POS_ACT" ? 3 : has_frames() ? 2 : 1);
    return result;
  });
  program.bind("CWRITE", [this](std::span<Value* const> a) {
    write_command(a[3]->text());
    return Value();
  });
}

// ---- EthernetKRL

krl::Value EkiMachine::status(std::size_t waiting, bool failed) const {
  Value result(program.type("EKI_STATUS"));
  result.part("BUFF").set_whole(static_cast<std::int32_t>(waiting));
  result.part("MSG_NO").set_whole(failed ? 9 : 0);
  result.part("CONNECTED").set_whole(channel.connected());
  return result;
}

krl::Value EkiMachine::take(const Value& path, Value& into, const char* kind) {
  const auto value = channel.get(path.text());
  if (!value) return status(0, true);
  into.set(*value);
  // The fault of a robot program that does not answer: a move is received as a heartbeat.
  constexpr double kMove = 3.0, kBeat = 2.0;
  if (faults.forgetful && path.text().ends_with(kind) && *value == kMove) into.set(kBeat);
  return status(0, false);
}

void EkiMachine::bind_channel() {
  using Arguments = std::span<Value* const>;
  const auto bind = [this](const char* name, std::function<Value(Arguments)> function) {
    program.bind(name, std::move(function));
  };
  bind("EKI_INIT", [this](Arguments) { return channel.init(), status(0, false); });
  bind("EKI_OPEN", [this](Arguments) {
    reopen_at = now + std::chrono::milliseconds(config.reopen_ms);
    return status(0, false);
  });
  bind("EKI_CLEAR", [this](Arguments) {
    config.clears_on_reconnect ? channel.clear() : channel.close();
    return status(0, false);
  });
  bind("EKI_CLEARBUFFER", [this](Arguments) { return channel.empty_queues(), status(0, false); });
  bind("EKI_CHECKBUFFER", [this](Arguments a) {
    return status(faults.deaf ? 0 : channel.waiting(a[1]->text()), !channel.exists());
  });
  for (const char* name : {"EKI_GETINT", "EKI_GETREAL"})
    bind(name, [this](Arguments a) { return take(*a[1], *a[2], "/@Type"); });
  bind("EKI_SETINT", [this](Arguments a) {
    return channel.set(a[1]->text(), std::to_string(a[2]->i)), status(0, false);
  });
  bind("EKI_SETREAL", [this](Arguments a) {
    return channel.set(a[1]->text(), krl_real(a[2]->r)), status(0, false);
  });
  bind("EKI_SEND", [this](Arguments a) {
    if (!faults.muted) channel.send(a[1]->text());
    return status(0, false);
  });
}

}  // namespace cellcal::sim
