#include "sim/krc/eki_controller.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "calib/export/krl_text.h"
#include "drivers/units.h"

namespace cellcal::sim {

namespace {

using drivers::kDegPerRad;
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

/// The number in $IN[n] or $OUT[n]; 0: the line has none.
int subscript_of(const calib::krl::Line& line, std::string_view variable) {
  const auto& tokens = line.tokens;
  for (std::size_t i = 0; i + 2 < tokens.size(); ++i)
    if (tokens[i].is(variable)) return static_cast<int>(tokens[i + 2].value);
  return 0;
}

}  // namespace

EkiController::Wiring EkiController::wiring_of(const EkiControllerConfig::Files& files) {
  Wiring wiring;
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

EkiController::EkiController(EkiControllerConfig c)
    : config_(std::move(c)),
      wiring_(wiring_of(config_.files)),
      channel_(EkiChannelConfig::parse(channel_of(config_.files))),
      arm_(config_.start_rad, config_.lag_s),
      program_(modules_of(config_.files), kVariables),
      robot_(program_, this),
      submit_(program_),
      random_(config_.seed) {
  if (channel_.config().udp || channel_.config().receive.empty() ||
      channel_.config().send.empty()) {
    throw std::invalid_argument(
        "EKI channel file: cellcal's programs need TCP, and elements to receive and to send");
  }
  axes_ = config_.start_rad.size();
  if (axes_ == 0 || axes_ > drivers::kMaxAxes) {
    throw std::invalid_argument("emulated EKI controller: 1 to 12 axes");
  }
  if (config_.linear_unit && axes_ <= drivers::kArmAxes)
    throw std::invalid_argument(
        "emulated EKI controller: a linear unit carries an arm of six axes");
  wire_ = {axes_, config_.linear_unit};
  if (config_.cycle_ms <= 0 || config_.interrupt_ms % config_.cycle_ms != 0 ||
      !(config_.lag_s > 0.0)) {
    throw std::invalid_argument(
        "emulated EKI controller: interrupt_ms must be a multiple of cycle_ms, lag_s positive");
  }
  if (config_.max_speed_rad_s.empty()) config_.max_speed_rad_s.assign(axes_, kUsualFrameSpeed);
  if (config_.max_speed_rad_s.size() != axes_) {
    throw std::invalid_argument("emulated EKI controller: max_speed_rad_s needs one per axis");
  }
  bind_state();
  bind_variables();
  bind_timers();
  bind_channel();
  bind_kinematics();
  channel_.open();
  submit_.select("CELLCAL_LOOP");
}

// ---- the cycle

void EkiController::tick(TimePoint at) {
  now_ = at;
  measurement_.reset();
  read_input_edges();
  scale_speed();
  const double seconds = std::chrono::duration<double>(now_.time_since_epoch()).count();
  // It has run since power on, before any program was selected.
  if (cycles_ == 0) submit_.run(seconds);
  if (program_state() == ProgramState::kActive && !stopping_) {
    if (cycles_ % static_cast<std::uint64_t>(config_.interrupt_ms / config_.cycle_ms) == 0) {
      interrupting_ = true;
      robot_.poll_interrupts();
      interrupting_ = pulse_ = false;
    }
    robot_.run(seconds);
    if (robot_.state() == krl::Interpreter::State::kEnded) state_ = ProgramState::kEnd;
    if (robot_.state() == krl::Interpreter::State::kFailed) {
      stop_message_ = true;
      stop_program();
    }
    if (robot_.state() == krl::Interpreter::State::kHalted) stop_program();
  }
  arm_.tick(now_, 1e-3 * config_.cycle_ms);
  settle();
  if (reopen_at_ && now_ >= *reopen_at_) {
    reopen_at_.reset();
    channel_.open();
  }
  if (!submit_halted_) submit_.run(seconds);
  ++cycles_;
}

void EkiController::read_input_edges() {
  while (!edges_.empty() && edges_.front().first <= now_) {
    const auto [at, closed] = edges_.front();
    edges_.pop_front();
    if (closed && !input_level_) {
      pulse_ = true;
      if (!input_edge_) {
        measurement_.reset();
        input_edge_ = config_.latches_setpoint ? arm_.setpoint() : arm_.actual_at(at);
      }
    }
    input_level_ = closed;
  }
}

// ---- the selected program

EkiController::ProgramState EkiController::program_state() const {
  const bool released = manual() && !start_held_;
  return state_ == ProgramState::kActive && released ? ProgramState::kStop : state_;
}

void EkiController::start(const char* name) {
  stop_message_ = false;
  if (state_ == ProgramState::kActive && selected_ == name) return;  // it runs, or still brakes
  const bool failed = robot_.state() == krl::Interpreter::State::kFailed;
  if (state_ == ProgramState::kStop && selected_ == name && !failed) {
    state_ = ProgramState::kActive;
    robot_.go_on();
    if (phase_ == Phase::kHeld) go();
    return;
  }
  selected_ = name;
  state_ = ProgramState::kActive;
  stopping_ = cancelling_ = false;
  phase_ = Phase::kIdle;
  robot_.select(name);
}

void EkiController::stop_program() {
  if (state_ != ProgramState::kActive) return;
  stopping_ = true;
  if (moving()) arm_.brake(kSafetyFactor * axes_acceleration_);
  settle();
}

bool EkiController::cancel() {
  if (program_state() == ProgramState::kActive) return false;
  state_ = ProgramState::kFree;
  selected_.clear();
  robot_.cancel();
  stopping_ = cancelling_ = false;
  if (arm_.at_rest()) {
    phase_ = Phase::kIdle;
    return true;
  }
  arm_.brake(kSafetyFactor * axes_acceleration_);
  phase_ = Phase::kDropped;
  return true;
}

void EkiController::settle() {
  if (!arm_.at_rest() && (moving() || phase_ == Phase::kDropped)) return;
  if (phase_ == Phase::kDropped) phase_ = Phase::kIdle;
  if (phase_ == Phase::kBraking) phase_ = Phase::kBraked;
  if (stopping_) {
    stopping_ = false;
    state_ = ProgramState::kStop;
    if (phase_ == Phase::kMoving) phase_ = Phase::kHeld;
    if (cancelling_) cancel();
    return;
  }
  if (phase_ == Phase::kMoving) phase_ = Phase::kIdle;
}

int EkiController::asked(const char* function) {
  krl::Interpreter question(program_);
  question.select(std::string("CELLCAL_SUB:") + function);
  question.run(0.0);
  return question.result() ? question.result()->i : 0;
}

// ---- operator

void EkiController::start_program() {
  start(selected_ == "CELL" && state_ != ProgramState::kFree ? "CELL" : "CELLCAL_EKI");
}

void EkiController::call_program() {
  start("CELL");
  system("CELL_CALLS").set_whole(1);
}

bool EkiController::program_runs() {
  return state_ == ProgramState::kActive &&
         (robot_.is_in("CELLCAL_EKI") || system("CELL_CALLS").truth());
}

void EkiController::cancel_program() {
  cancelling_ = true;
  stop_program();
  cancel();
}

void EkiController::emergency_stop(bool pressed) {
  e_stop_ = pressed;
  if (!pressed) return;
  stop_message_ = true;
  stop_program();
}

void EkiController::drives(bool on) {
  drives_on_ = on;
  if (!on) stop_program();
}

void EkiController::mode(OperatingMode mode) {
  // Turning the key switch stops and cancels any program.
  if (mode != mode_) cancel_program();
  mode_ = mode;
}

void EkiController::set_override(int percent) { override_percent_ = std::clamp(percent, 0, 100); }

void EkiController::place(const std::vector<double>& pose_rad) {
  if (!arm_.at_rest() || pose_rad.size() != axes_) {
    throw std::invalid_argument("emulated EKI controller: place() at rest, one angle per axis");
  }
  arm_.place(pose_rad);
}

void EkiController::input_broken(bool broken, TimePoint t) {
  const bool closed = input_closed_;
  input_broken_ = false;
  if (!wiring_.contact_is_on) input(t, broken || closed);
  input_broken_ = broken;
  input_closed_ = closed;
}

void EkiController::input(TimePoint t, bool closed) {
  input_closed_ = closed;
  if (input_broken_) return;
  // Delay of the filter, and until the next sample.
  const double since_epoch = std::chrono::duration<double>(t.time_since_epoch()).count();
  const double filtered = since_epoch + config_.input_delay_s;
  const double sample = config_.input_sample_s;
  const double seen = sample > 0.0 ? std::ceil(filtered / sample) * sample : filtered;
  edges_.emplace_back(t + drivers::from_seconds(seen - since_epoch), closed);
}

// ---- motion

KukaFrame EkiController::frame_of(const std::vector<double>& rad) const {
  if (config_.arm) return config_.arm->frame(rad);
  // Without geometry each axis is 1 m from the TCP.
  KukaFrame frame{};
  for (std::size_t i = 0; i < std::min<std::size_t>(6, axes_); ++i)
    frame[i] = rad[i] * (i < 3 ? 1000.0 : kDegPerRad);
  return frame;
}

std::vector<double> EkiController::target_of(const krl::Motion& motion) const {
  const Value& to = motion.target;
  if (motion.kind == krl::Motion::Kind::kPtpRel || motion.kind == krl::Motion::Kind::kLinRel)
    throw krl::RunError("relative motions are not modelled");
  std::vector<double> rad = arm_.setpoint();
  const bool axial = to.type->index_of("A1") == 0;
  KukaFrame frame = frame_of(rad);
  for (std::size_t i = 0; i < to.parts.size(); ++i) {
    const std::string& name = to.type->names[i];
    if (!to.parts[i].given || name == "S" || name == "T") continue;
    const std::size_t number = name.size() > 1 ? static_cast<std::size_t>(name[1] - '1') : 0;
    const std::size_t place = number + (name[0] == 'E' ? drivers::kArmAxes : 0);
    if (!axial && i < 6) {
      frame[i] = to.parts[i].r;
    } else if (place < axes_) {
      const std::size_t axis = wire_.at_place(place);
      rad[axis] = wire_.inside(axis, to.parts[i].r);
    }
  }
  if (axial) return rad;
  if (config_.arm) {
    const auto found = config_.arm->axes(frame, rad);
    if (!found) throw krl::RunError("work envelope exceeded");
    std::copy(found->begin(), found->end(), rad.begin());
    return rad;
  }
  for (std::size_t i = 0; i < std::min<std::size_t>(6, axes_); ++i)
    rad[i] = frame[i] / (i < 3 ? 1000.0 : kDegPerRad);
  return rad;
}

double EkiController::path_m(const std::vector<double>& to) const {
  constexpr double kShortestM = 1e-6;
  const KukaFrame a = frame_of(arm_.setpoint()), b = frame_of(to);
  return std::max(kShortestM, 1e-3 * std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]));
}

/// Speed of a LIN [1/s]: $VEL.CP along the path, $VEL.ORI1 for the rotation.
double EkiController::linear_speed(const std::vector<double>& to) {
  const auto& velocity = system("$VEL").parts;
  const KukaFrame a = frame_of(arm_.setpoint()), b = frame_of(to);
  double turn = 0.0;
  for (std::size_t i = 3; i < 6; ++i)
    turn = std::max(turn, std::abs(std::remainder(b[i] - a[i], 360.0)));
  const double speed = velocity[0].r / path_m(to);
  return turn > 0.0 ? std::min(speed, velocity[1].r / turn) : speed;
}

void EkiController::move(const krl::Motion& motion) {
  target_ = target_of(motion);
  const bool lin = motion.kind == krl::Motion::Kind::kLin;
  double speed = 1e9, acceleration = 1e9, travel = 0.0;
  for (std::size_t i = 0; i < axes_; ++i) {
    const double share = std::abs(target_[i] - arm_.setpoint()[i]);
    travel = std::max(travel, share);
    if (share <= 0.0) continue;
    const std::size_t place = wire_.place(i);
    const Value& percent = system(place < 6 ? "$VEL_AXIS" : "$VEL_EXTAX").parts[place % 6];
    speed = std::min(speed, config_.max_speed_rad_s[i] / share * (lin ? 1.0 : percent.i / 100.0));
    acceleration = std::min(acceleration, config_.max_acceleration_rad_s2 / share);
  }
  if (travel <= 0.0) return;
  if (robot_.is_in("CC_MOVE")) ++moves_;
  line_travel_ = travel;
  line_speed_ = lin ? std::min(speed, linear_speed(target_)) : speed;
  axes_acceleration_ = acceleration;
  line_acceleration_ =
      lin ? std::min(acceleration, system("$ACC").parts[0].r / path_m(target_)) : acceleration;
  input_edge_.reset();
  go();
}

void EkiController::go() {
  arm_.go(target_, line_speed_, line_acceleration_);
  phase_ = Phase::kMoving;
}

void EkiController::go_on() {
  if (phase_ == Phase::kBraked) go();
}

void EkiController::brake(bool fast) {
  if (phase_ != Phase::kMoving) return;
  arm_.brake(fast ? config_.fast_brake_factor * axes_acceleration_ : line_acceleration_);
  phase_ = Phase::kBraking;
}

void EkiController::scale_speed() {
  double scale = override_percent_ / 100.0;
  if (mode_ == OperatingMode::kT1 && line_travel_ > 0.0) {
    const double limit = kT1PtpShare * *std::min_element(config_.max_speed_rad_s.begin(),
                                                         config_.max_speed_rad_s.end());
    scale = std::min(scale, limit / (line_speed_ * line_travel_));
  }
  arm_.scale(manual() && !start_held_ ? 0.0 : scale);
}

}  // namespace cellcal::sim
