#pragma once
// A KUKA controller that executes cellcal's EKI files (drivers/kuka/krl) in the interpreter of sim/krl, without sockets,
// threads or clock: submit and robot interpreter, arm, operating modes, drives, emergency stop, override.
//
// After the public documentation of EKI; undocumented behaviour is configurable: the time at which $AXIS_INT is taken, the
// latency of an interrupt.

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/kuka/wire/eki_codec.h"
#include "drivers/time.h"
#include "sim/krc/cartesian_arm.h"
#include "sim/krc/eki_channel.h"

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

class EkiController {
 public:
  /// Throws std::invalid_argument.
  explicit EkiController(EkiControllerConfig config);
  ~EkiController();
  EkiController(const EkiController&) = delete;
  EkiController& operator=(const EkiController&) = delete;

  /// The next interpolation cycle, at `now` (the caller keeps the clock).
  void tick(drivers::TimePoint now);
  drivers::Duration cycle() const;
  /// The contact input's level from t on, t within the current cycle or before.
  void input(drivers::TimePoint t, bool closed);

  // ---- network
  bool connect();  ///< false: refused
  void disconnect();
  bool connected() const;
  void receive(std::string_view bytes);
  std::string drain_output();

  // ---- operator
  void start_program();        ///< selects it if necessary, and starts or continues it
  void start_other_program();  ///< CELLCAL_EKI is deselected for another program
  /// CELL.SRC, selected and started in EXT, calls CELLCAL_EKI, which returns at the end of a session.
  void call_program();
  bool program_runs() const;  ///< CELLCAL_EKI, for any selected program
  /// File, line and fault of a program that the controller has stopped; empty: none.
  std::string fault() const;
  /// $BRAKETEST_REQ_INT and similar, on outputs read by the submit program.
  void request(drivers::ControllerRequest request);
  void cancel_program();  ///< stopped by a ramp and deselected; nothing continues afterwards
  void emergency_stop(bool pressed);
  void drives(bool on);
  void mode(drivers::OperatingMode mode);
  void start_key(bool held);  ///< effective in T1 and T2
  void set_override(int percent);
  void place(const std::vector<double>& pose_rad);  ///< jogged; only at rest
  void reconfigure_io();  ///< Reconfigure I/Os, or end of hibernation: EKI's channel is deleted

  // ---- faults
  /// An external axis is moved by something else: per second, radians or metres; 0 ends it.
  void creep(std::size_t axis, double per_s);
  void mute(bool muted) { muted_ = muted; }           ///< no states are sent
  void deaf(bool deaf) { deaf_ = deaf; }              ///< the submit program reads nothing
  void forgetful(bool on) { forgetful_ = on; }        ///< moves are accepted and never confirmed
  void halt_submit(bool on) { submit_halted_ = on; }  ///< its interpreter is stopped
  /// Wire broken: the input is off, i.e. free or contact depending on the program.
  void input_broken(bool broken, drivers::TimePoint t);

  std::vector<double> actual_rad_at(drivers::TimePoint t) const;
  std::vector<double> setpoint_rad() const;
  bool moving() const;
  bool ready() const;
  std::uint32_t session() const;
  std::uint64_t moves() const;  ///< started since power on
  /// Current TOOL_DATA or BASE_DATA. Throws std::out_of_range.
  drivers::EkiFrameValues frame(drivers::EkiFrameKind kind, int number) const;
  std::uint64_t frames_set() const;  ///< since power on
  int advice() const;                ///< CELLCAL_ADVICE
  int advice_until() const;          ///< CELLCAL_ADVICE_UNTIL
  const EkiChannel& channel() const;

 private:
  std::unique_ptr<struct EkiMachine> impl_;
  bool muted_ = false, deaf_ = false, forgetful_ = false, input_broken_ = false,
       input_closed_ = false;
  bool submit_halted_ = false;
};

}  // namespace cellcal::sim
