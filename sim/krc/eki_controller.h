#pragma once
// A KUKA controller that executes cellcal's EKI files (drivers/kuka/krl) in the interpreter of sim/krl, without sockets,
// threads or clock: submit and robot interpreter, arm, operating modes, drives, emergency stop, override.
//
// After the public documentation of EKI; undocumented behaviour is configurable: the time at which $AXIS_INT is taken, the
// latency of an interrupt.

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/kuka/wire/eki_codec.h"
#include "drivers/kuka/wire/wire_axes.h"
#include "drivers/time.h"
#include "sim/krc/cartesian_arm.h"
#include "sim/krc/eki_arm.h"
#include "sim/krc/eki_channel.h"
#include "sim/krl/interpreter.h"

namespace cellcal::sim {

struct EkiControllerConfig {
  using Files = std::map<std::string, std::string>;
  Files files;  ///< installed on the controller: channel (.xml) and KRL
  /// start_rad[0] is a linear unit's position [m]: E1, which carries the arm. As elsewhere metres and
  /// millimetres where a name has radians and degrees.
  bool linear_unit = false;
  std::vector<double> start_rad{0.0, -1.5707963267948966, 1.5707963267948966,
                                0.0, 1.5707963267948966,  0.0};
  std::vector<double> max_speed_rad_s;    ///< per axis at 100 %; empty: 3 rad/s
  double max_acceleration_rad_s2 = 10.0;  ///< of PTP, as set by the program ($ACC_AXIS)
  /// Geometry for LIN's length; null: every axis at 1 m from the TCP.
  std::shared_ptr<const CartesianArm> arm;
  /// Model of the arm in $POS_ACT alone, such as an absolutely accurate one; null: `arm`.
  std::shared_ptr<const CartesianArm> states;
  double lag_s = 0.02;            ///< setpoint to arm
  int cycle_ms = 4;               ///< interpolation cycle
  int interrupt_ms = 12;          ///< interrupt cycle
  int reopen_ms = 100;            ///< until the port reopens after a disconnection
  double input_delay_s = 0.001;   ///< filter of the digital input ...
  double input_sample_s = 0.002;  ///< ... and its sampling period
  bool latches_setpoint = false;  ///< $AXIS_INT is the setpoint instead of the actual position
  int timer_ms = 12;              ///< resolution of $TIMER, which stamps the states
  /// BRAKE F relative to PTP's acceleration: the maximum with $ACC_AXIS at 50. BRAKE: the motion's
  /// own.
  double fast_brake_factor = 2.0;
  double noise_sigma_deg = 0.0;  ///< of $AXIS_ACT_MEAS and $AXIS_INT only
  std::uint64_t seed = 1;
  std::vector<double> soft_min_rad, soft_max_rad;  ///< software limit switches; empty: none
  /// TOOL_DATA[1..] and BASE_DATA[1..] of $config.dat. Can be set if the files permit it.
  std::vector<drivers::EkiFrameValues> tool_data = std::vector<drivers::EkiFrameValues>(16);
  std::vector<drivers::EkiFrameValues> base_data = std::vector<drivers::EkiFrameValues>(32);
  bool clears_on_reconnect = true;  ///< the program's EKI_Clear; false: queues keep stale data
};

class EkiController final : krl::Mover {
 public:
  using OperatingMode = drivers::OperatingMode;
  using TimePoint = drivers::TimePoint;

  /// Throws std::invalid_argument.
  explicit EkiController(EkiControllerConfig config);

  /// The next interpolation cycle, at `now` (the caller keeps the clock).
  void tick(TimePoint now);
  drivers::Duration cycle() const { return std::chrono::milliseconds(config_.cycle_ms); }
  /// The contact input's level from t on, t within the current cycle or before.
  void input(TimePoint t, bool closed);

  // ---- network
  bool connect() { return channel_.connect(); }  ///< false: refused
  void disconnect() { channel_.disconnect(); }
  bool connected() const { return channel_.connected(); }
  void receive(std::string_view bytes) { channel_.receive(bytes); }
  std::string drain_output() { return channel_.drain_output(); }

  // ---- operator
  void start_program();  ///< selects it if necessary, and starts or continues it
  void start_other_program() { start("OTHER"); }  ///< CELLCAL_EKI is deselected for another program
  /// CELL.SRC, selected and started in EXT, calls CELLCAL_EKI, which returns at the end of a session.
  void call_program();
  bool program_runs();  ///< CELLCAL_EKI, for any selected program
  /// File, line and fault of a program that the controller has stopped; empty: none.
  std::string fault() const { return robot_.message() + submit_.message(); }
  /// $BRAKETEST_REQ_INT and similar, on outputs read by the submit program.
  void request(drivers::ControllerRequest request) { request_ = request; }
  void cancel_program();  ///< stopped by a ramp and deselected; nothing continues afterwards
  void emergency_stop(bool pressed);
  void drives(bool on);
  void mode(OperatingMode mode);
  void start_key(bool held) { start_held_ = held; }  ///< effective in T1 and T2
  void set_override(int percent);
  void place(const std::vector<double>& pose_rad);  ///< jogged; only at rest
  /// Reconfigure I/Os, or end of hibernation: EKI's channel is deleted.
  void reconfigure_io() { channel_.remove(); }

  // ---- faults
  /// An external axis is moved by something else: per second, radians or metres; 0 ends it.
  void creep(std::size_t axis, double per_s) { arm_.creep(axis, per_s); }
  void mute(bool muted) { muted_ = muted; }           ///< no states are sent
  void deaf(bool deaf) { deaf_ = deaf; }              ///< the submit program reads nothing
  void forgetful(bool on) { forgetful_ = on; }        ///< moves are accepted and never confirmed
  void halt_submit(bool on) { submit_halted_ = on; }  ///< its interpreter is stopped
  /// Wire broken: the input is off, i.e. free or contact depending on the program.
  void input_broken(bool broken, TimePoint t);

  std::vector<double> actual_rad_at(TimePoint t) const { return arm_.actual_at(t); }
  std::vector<double> setpoint_rad() const { return arm_.setpoint(); }
  bool at_rest() const { return arm_.at_rest(); }
  bool ready() { return asked("CC_IS_READY") != 0; }
  std::uint32_t session() { return static_cast<std::uint32_t>(system("CC_SESSION").i); }
  std::uint64_t moves() const { return moves_; }  ///< started since power on
  /// Current TOOL_DATA or BASE_DATA. Throws std::out_of_range.
  drivers::EkiFrameValues frame(drivers::EkiFrameKind kind, int number);
  std::uint64_t frames_set() const { return frames_set_; }  ///< since power on
  int advice() { return whole_or_0("CELLCAL_ADVICE"); }
  int advice_until() { return whole_or_0("CELLCAL_ADVICE_UNTIL"); }
  const EkiChannel& channel() const { return channel_; }

 private:
  /// $PRO_STATE1 of the selected program.
  enum class ProgramState { kFree = 1, kActive = 3, kStop = 4, kEnd = 5 };
  bool manual() const { return mode_ == OperatingMode::kT1 || mode_ == OperatingMode::kT2; }
  ProgramState program_state() const;
  void start(const char* name);
  void stop_program();  ///< STOP, drives off, emergency stop: a ramp, and the program is stopped
  bool cancel();        ///< CANCEL; false: refused
  void settle();        ///< state of program and motion once the arm is at rest
  /// A function of the submit program without parameters; 0 before the first pass.
  int asked(const char* function);

  // ---- Mover
  void move(const krl::Motion& motion) override;
  bool moving() const override { return phase_ == Phase::kMoving || phase_ == Phase::kBraking; }
  void brake(bool fast) override;
  void drop_motion() override { phase_ = Phase::kIdle; }
  void go_on() override;

  // ---- motion
  std::vector<double> target_of(const krl::Motion& motion) const;
  KukaFrame frame_of(const std::vector<double>& rad) const;
  double linear_speed(const std::vector<double>& target);
  double path_m(const std::vector<double>& target) const;
  void go();
  void scale_speed();
  void read_input_edges();
  std::vector<double> measured();
  bool has_frames();

  // ---- system variables and external routines (eki_variables.cc)
  krl::Value& system(const char* name) { return program_[name]; }
  int whole_or_0(const char* name) { return program_.has(name) ? program_[name].i : 0; }
  void set_axes(krl::Value& value, const std::vector<double>& rad) const;
  void set_external(krl::Value& position, const std::vector<double>& rad) const;
  void bind_state();
  void bind_variables();
  void bind_timers();
  void bind_channel();
  void bind_kinematics();
  void write_command(const std::string& command);
  std::int64_t timer_ms() const;
  krl::Value status(std::size_t waiting, bool failed) const;
  krl::Value take(const krl::Value& path, krl::Value& into, const char* kind);

  /// Inputs and outputs that the programs name: the cell is wired as they expect.
  struct Wiring {
    int input = 1;
    bool contact_is_on = true;
    std::array<int, 4> request_output{};  ///< by ControllerRequest; 0: none
  };
  static Wiring wiring_of(const EkiControllerConfig::Files& files);

  /// kHeld: the program was stopped in mid-motion. kBraked: an interrupt has stopped it. kDropped: cancelled.
  enum class Phase { kIdle, kMoving, kBraking, kBraked, kHeld, kDropped };

  EkiControllerConfig config_;
  Wiring wiring_;
  EkiChannel channel_;
  EkiArm arm_;
  krl::Program program_;
  krl::Interpreter robot_, submit_;
  bool muted_ = false, deaf_ = false, forgetful_ = false, submit_halted_ = false;
  std::size_t axes_ = 0;
  drivers::WireAxes wire_{0, false};
  std::mt19937_64 random_;
  std::uint64_t cycles_ = 0, moves_ = 0, frames_set_ = 0;
  TimePoint now_{};
  std::optional<std::vector<double>> measurement_;  ///< of this cycle
  std::optional<TimePoint> reopen_at_;
  struct Timer {
    bool stopped = true;
    std::int64_t value = 0, since = 0;
  };
  std::array<Timer, 64> timers_{};

  Phase phase_ = Phase::kIdle;
  std::vector<double> target_;
  double line_speed_ = 0.0, line_travel_ = 0.0, line_acceleration_ = 0.0;
  double axes_acceleration_ = 0.0;  ///< of a PTP on this line

  // inputs and operator
  std::deque<std::pair<TimePoint, bool>> edges_;
  bool input_level_ = false, pulse_ = false, interrupting_ = false;
  bool input_broken_ = false, input_closed_ = false;
  std::optional<std::vector<double>> input_edge_;  ///< position at the first one of a motion
  ProgramState state_ = ProgramState::kFree;
  std::string selected_;
  bool stopping_ = false, cancelling_ = false;
  drivers::ControllerRequest request_ = drivers::ControllerRequest::kNone;
  bool drives_on_ = true, e_stop_ = false, stop_message_ = false, start_held_ = true;
  OperatingMode mode_ = OperatingMode::kAut;
  int override_percent_ = 100;
};

}  // namespace cellcal::sim
