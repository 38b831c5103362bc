#pragma once
// A KUKA controller as seen through RSI, without sockets, threads or clock: hard cycle, late
// counting, time-out stop, axis and Cartesian corrections with clamps and monitors, a lagging arm,
// operating modes, drives and emergency stop.
//
// Model: the setpoint of one cycle is the start pose plus the current correction; each axis follows
// it as a first-order lag, integrated exactly. Gravity, servo ripple and the mechanical path after
// a stop are not modelled: a stopped arm rests at its position. With a Cartesian correction axis
// corrections have no effect (undocumented for a real controller).

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/kuka/wire/rsi_codec.h"
#include "drivers/kuka/wire/wire_axes.h"
#include "drivers/robot.h"
#include "drivers/time.h"
#include "sim/krc/cartesian_arm.h"
#include "sim/krc/rsi_channel.h"
#include "sim/krc/rsi_program.h"

namespace cellcal::sim {

/// RSI_ON's argument. kAbsolute: a correction is the total offset from the start pose. kRelative:
/// it is added in every cycle; with HOLDON=1 also in those without a reply.
enum class RsiMode { kAbsolute, kRelative };

/// Parameter Mode of the STOP object. 1 to 3 stop the arm, and RSI continues without effect.
enum class RsiStop { kInfo = 0, kPathStop = 1, kSpeedStop = 2, kFastStop = 3, kExitMoveCorr = 4 };

using drivers::OperatingMode;

/// The names are those of `channel`'s elements where it is empty; an empty one: not connected.
struct ControllerConfig : drivers::RsiNames {
  /// start_rad[0] is a linear unit's position [m]: E1, which carries the arm. As elsewhere metres and
  /// millimetres where a name has radians and degrees.
  bool linear_unit = false;
  std::vector<double> start_rad{0.0, -1.5707963267948966, 1.5707963267948966,
                                0.0, 1.5707963267948966,  0.0};  ///< KUKA's home pose
  int cycle_ms = 4;                                              ///< 4 (#IPO_FAST) or 12 (#IPO)
  double lag_s = 0.02;  ///< time constant, setpoint to actual position; typically 10..40 ms
  int precision = 4;    ///< decimals of the packets; KUKA's default is 1

  /// The installed ethernet file. Empty: derived from the names and switches below.
  std::optional<RsiChannelConfig> channel;
  std::string cartesian_tag = "RKorr";
  bool hold_on = true;                   ///< false: a late reply resets the correction to 0
  bool send_setpoint = true;             ///< DEF_ASPos connected
  bool send_cartesian_setpoint = false;  ///< DEF_RSol connected
  bool send_delay = true;                ///< DEF_Delay connected

  RsiMode mode = RsiMode::kAbsolute;
  RsiStop stop_mode = RsiStop::kExitMoveCorr;
  int timeout_cycles = 100;  ///< late replies tolerated before KSS29002
  /// After an emergency stop packets and RSI continue with the arm stopped; after its release, Start
  /// moves the arm to its correction. False: RSI ends. The behaviour of each release is unknown.
  bool rsi_outlives_stop = false;
  bool timeout_counts_total = false;   ///< the meaning of KUKA's count is unknown
  bool first_frame_only_ipoc = false;  ///< as in RSI 2
  double clamp_deg = 90.0;             ///< AXISCORR's limit: clamps silently
  /// cellcal_rsi.src, executed around RSI_ON; empty: one that sets no limits and leaves `mode`.
  std::string program;
  double monitor_deg = 90.0;  ///< AXISCORRMON: stops with KSS29000
  /// AXISCORREXT's limits of E1 on and AXISCORRMON's [deg], of a linear unit [mm]; beyond their ends: wide.
  std::vector<double> clamp_external, monitor_external;
  double clamp_mm = 1000.0, clamp_turn_deg = 180.0;      ///< POSCORR's, likewise
  double monitor_mm = 1000.0, monitor_turn_deg = 180.0;  ///< POSCORRMON's
  CorrectionFrame cartesian_system = CorrectionFrame::kBase;
  std::shared_ptr<const CartesianArm> arm;  ///< null: RIst is 0, Cartesian corrections are a fault
  /// Model of the arm in RIst alone, such as an absolutely accurate one; null: `arm`.
  std::shared_ptr<const CartesianArm> states;
  std::vector<double> max_speed_rad_s;  ///< per axis, 'Command velocity' fault; empty: no check
  /// Per axis, 'Command gear torque' fault: maximum of the drives. Empty: no check.
  std::vector<double> max_acceleration_rad_s2;
  std::vector<double> soft_min_rad, soft_max_rad;  ///< software limit switches; empty: none
  double noise_sigma_deg = 0.0;                    ///< of the reported AIPos only
  std::uint64_t seed = 1;
  std::uint64_t ipoc_start = 1'000'000;
  int ipoc_step = 0;  ///< per packet; 0: the cycle's milliseconds

  /// The effective channel: from the file, or from names and switches.
  RsiChannelConfig effective_channel() const;
};

enum class RsiPhase { kBeforeRsiOn, kRunning, kEnded, kFaulted };

class Controller {
 public:
  explicit Controller(ControllerConfig config);

  /// The program is reset, selected and started: RSI_ON at the current pose, correction 0, Delay 0.
  /// Without drives, or with the emergency stop pressed, it ends immediately with a message.
  void rsi_on();
  /// The next cycle, at `now` (the caller keeps the hard clock). Returns the datagram to send,
  /// valid until the next call; empty while RSI does not run.
  std::string_view tick(drivers::TimePoint now);
  /// A reply from the PC, effective at the next tick if SENTYPE and IPOC are correct.
  void receive(std::string_view reply);

  /// True position of the arm [rad] at t, from the last tick up to the next, following the current
  /// setpoint.
  std::vector<double> actual_rad_at(drivers::TimePoint t) const;
  std::vector<double> setpoint_rad() const {
    return setpoint_;
  }  ///< start pose plus current correction
  /// Current one of the axes, clamped: A1 to A6, E1 on [deg], of a linear unit [mm].
  std::vector<double> correction_deg() const { return axis_deg_; }
  const KukaFrame& cartesian_correction() const { return frame_; }  ///< current [mm, deg]

  RsiPhase phase() const { return phase_; }
  /// Pendant's text after a fault or an end; otherwise empty.
  const std::string& message() const { return message_; }
  std::uint64_t late() const { return late_; }  ///< late or rejected replies in this session: Delay
  /// Late replies since power on, of sessions with any reply.
  std::uint64_t late_ever() const { return late_ever_; }
  std::uint64_t taken_ever() const { return taken_ever_; }  ///< replies accepted since power on
  std::uint64_t packets() const { return packets_; }        ///< sent, in this session
  std::uint64_t ipoc() const { return ipoc_; }
  drivers::Duration cycle() const { return std::chrono::milliseconds(config_.cycle_ms); }

  // ---- operator
  void emergency_stop(bool pressed);
  void drives(bool on);
  /// T1: the TCP is limited to 250 mm/s (without geometry: 6 % of the axes' speeds). Turning the
  /// switch stops any program.
  void mode(OperatingMode mode);
  void set_override(int percent);  ///< $OV_PRO, 0..100: does not scale corrections
  void start_key(bool held);       ///< effective in T1 and T2
  /// Level of the contact input from t on; packets contain the level at their tick. Off at power
  /// on.
  void input(drivers::TimePoint t, bool on) { edges_.emplace_back(t, on); }
  void cancel_program() { stop_running("Program cancelled"); }

  /// Faults. The arm keeps its position although the setpoint moves (drives off, brake closed).
  void block_drives(bool blocked) { blocked_ = blocked; }
  /// An axis follows no command, and moves by this per second, radians or metres; nullopt ends it.
  void slide(std::size_t axis, std::optional<double> per_s) {
    sliding_ = axis, slide_per_s_ = per_s;
  }
  /// Sets the arm to a pose; only while RSI does not run.
  void place(const std::vector<double>& pose_rad);

 private:
  void begin_at_actual();
  void start_program();
  std::vector<double> on_wire(const std::vector<double>& values) const;
  bool manual() const { return mode_ == OperatingMode::kT1 || mode_ == OperatingMode::kT2; }
  void stop_running(const char* why);
  void end(RsiPhase why, std::string words);
  void close_cycle();
  void correct();
  std::string monitors() const;
  std::optional<std::vector<double>> corrected() const;
  std::string objection(const std::vector<double>& next, const std::vector<double>& speed) const;
  void apply();
  void apply_stop();
  std::string packet();
  void read_input(drivers::TimePoint now);

  ControllerConfig config_;
  RsiChannelConfig channel_;
  std::size_t axes_ = 0;
  drivers::WireAxes wire_{0, false};
  RsiProgram program_;
  std::mt19937_64 random_;
  std::string text_;
  RsiPhase phase_ = RsiPhase::kBeforeRsiOn;
  OperatingMode mode_ = OperatingMode::kAut;
  int override_percent_ = 100;
  std::string message_;
  std::vector<double> base_, setpoint_, actual_, speed_rad_s_;
  std::vector<double> inputs_;    // outputs of the ETHERNET object, one per received value
  std::vector<double> axis_deg_;  // current corrections, in the wire's order
  std::vector<double> low_deg_, high_deg_;  // their limits
  KukaFrame frame_{};
  drivers::TimePoint tick_at_{};
  std::deque<std::pair<drivers::TimePoint, bool>> edges_;  // future edges of the contact input
  bool input_on_ = false;
  std::size_t sliding_ = 0;
  std::optional<double> slide_per_s_;
  bool ticked_ = false, blocked_ = false, halted_ = false;
  bool awaiting_ = false, answered_ = false, stop_seen_ = false, stop_level_ = false;
  bool first_frame_ = false, e_stop_ = false, drives_on_ = true, start_held_ = true;
  std::uint64_t ipoc_ = 0, late_ = 0, late_ever_ = 0, late_in_a_row_ = 0, packets_ = 0;
  std::uint64_t taken_ = 0, taken_ever_ = 0;
};

}  // namespace cellcal::sim
