#pragma once
// A KUKA controller as RSI shows it, without sockets, threads or clock: hard cycle, late counting,
// time-out stop, axis and Cartesian corrections with clamps and monitors, a lagging arm, operating
// modes, drives and emergency stop.
//
// Model: the setpoint of one cycle is the start pose plus the correction in force; each axis
// follows it as a first-order lag, integrated exactly. Gravity, servo ripple and the mechanical
// path after a stop are not modelled: a stopped arm rests where it is. Where the correction is
// Cartesian, that is what counts and axis corrections have no effect (a real controller does not
// say).

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/robot.h"
#include "drivers/time.h"
#include "sim/krc/cartesian_arm.h"
#include "sim/krc/rsi_channel.h"

namespace cellcal::sim {

/// RSI_ON's argument. kAbsolute: a correction is the whole offset from the start pose. kRelative:
/// it is added in every cycle; with HOLDON=1 also in those without a reply.
enum class RsiMode { kAbsolute, kRelative };

/// Parameter Mode of the STOP object. 1 to 3 stop the arm, and RSI goes on without effect.
enum class RsiStop { kInfo = 0, kPathStop = 1, kSpeedStop = 2, kFastStop = 3, kExitMoveCorr = 4 };

enum class OperatingMode { kT1, kT2, kAut, kExt };

struct ControllerConfig {
  std::vector<double> start_rad{0.0, -1.5707963267948966, 1.5707963267948966,
                                0.0, 1.5707963267948966,  0.0};  ///< KUKA's home pose
  int cycle_ms = 4;                                              ///< 4 (#IPO_FAST) or 12 (#IPO)
  double lag_s = 0.02;  ///< time constant, setpoint to actual position; 10..40 ms is usual
  int precision = 4;    ///< decimals of the packets; KUKA's default is 1

  /// The ethernet file that is installed. None: one is made of the names and switches below.
  std::optional<RsiChannelConfig> channel;
  std::string sentype = "ImFree";
  std::string axis_tag = "AK", external_axis_tag = "EK", cartesian_tag = "RKorr";
  std::string stop_tag = "Stop";
  bool hold_on = true;                   ///< false: a late reply lets the correction fall to 0
  bool send_setpoint = true;             ///< DEF_ASPos wired
  bool send_cartesian_setpoint = false;  ///< DEF_RSol wired
  bool send_delay = true;                ///< DEF_Delay wired
  /// STATUS and OV_PRO wired to SEND elements of these names, as RsiConfig; empty: not.
  std::string mode_tag = "Mode.R", override_tag = "OvPro.R";
  std::string contact_tag;  ///< DIGIN of the contact input, likewise

  RsiMode mode = RsiMode::kAbsolute;
  RsiStop stop_mode = RsiStop::kExitMoveCorr;
  int timeout_cycles = 100;                              ///< late replies tolerated before KSS29002
  /// After an emergency stop packets go on and RSI with them, the arm stands; once it is released, Start
  /// lets the arm go where its correction leads. False: RSI ends. Which one a release does is not known.
  bool rsi_outlives_stop = false;
  bool timeout_counts_total = false;                     ///< which one KUKA means is stated nowhere
  bool first_frame_only_ipoc = false;                    ///< RSI 2's habit
  double clamp_deg = 90.0;                               ///< AXISCORR's limit: clamps in silence
  /// CELLCAL_RSI's fence: at RSI_ON AXISCORR's limits are set to the ends of these ranges, within
  /// clamp_deg. Empty: a program that sets none.
  std::vector<double> fence_min_rad, fence_max_rad;
  double monitor_deg = 90.0;                             ///< AXISCORRMON: stops with KSS29000
  double clamp_mm = 1000.0, clamp_turn_deg = 180.0;      ///< POSCORR's, likewise
  double monitor_mm = 1000.0, monitor_turn_deg = 180.0;  ///< POSCORRMON's
  CorrectionFrame cartesian_system = CorrectionFrame::kBase;
  std::shared_ptr<const CartesianArm> arm;  ///< none: RIst is 0, Cartesian corrections are a fault
  std::vector<double> max_speed_rad_s;      ///< per axis, 'Command velocity' fault; empty: no check
  /// Per axis, 'Command gear torque' fault: what the drives can do at most. Empty: no check.
  std::vector<double> max_acceleration_rad_s2;
  std::vector<double> soft_min_rad, soft_max_rad;  ///< software limit switches; empty: none
  double noise_sigma_deg = 0.0;                    ///< of the reported AIPos alone
  std::uint64_t seed = 1;
  std::uint64_t ipoc_start = 1'000'000;
  int ipoc_step = 0;  ///< per packet; 0: the cycle's milliseconds

  /// The channel in force: the file's, or the one made of names and switches.
  RsiChannelConfig effective_channel() const;
};

enum class RsiPhase { kBeforeRsiOn, kRunning, kEnded, kFaulted };

class Controller {
 public:
  explicit Controller(ControllerConfig config);
  ~Controller();
  Controller(const Controller&) = delete;
  Controller& operator=(const Controller&) = delete;

  /// The program is reset, selected and started: RSI_ON in the pose where the arm stands,
  /// correction 0, Delay 0. Without drives, or with the emergency stop pressed, it ends at once and
  /// says so.
  void rsi_on();
  /// The next cycle, at `now` (the caller keeps the hard clock). Returns the datagram to send,
  /// valid until the next call; empty while RSI does not run.
  std::string_view tick(drivers::TimePoint now);
  /// A reply from the PC, taken into account at the next tick if SENTYPE and IPOC are right.
  void receive(std::string_view reply);

  /// True position of the arm [rad] at t, from the last tick up to the next: what the setpoint now
  /// in force makes of it.
  std::vector<double> actual_rad_at(drivers::TimePoint t) const;
  std::vector<double> setpoint_rad() const;       ///< start pose plus correction in force
  std::vector<double> correction_deg() const;     ///< of the axes, in force, clamped
  const KukaFrame& cartesian_correction() const;  ///< likewise [mm, deg]

  RsiPhase phase() const;
  const std::string& message() const;  ///< pendant's text after a fault or an end; else empty
  std::uint64_t late() const;          ///< replies late or not accepted, in this session: Delay
  /// Likewise since power on, of sessions that were answered at all.
  std::uint64_t late_ever() const;
  std::uint64_t taken_ever() const;  ///< replies taken since power on
  std::uint64_t packets() const;     ///< sent, in this session
  std::uint64_t ipoc() const;
  drivers::Duration cycle() const;

  // ---- operator
  void emergency_stop(bool pressed);
  void drives(bool on);
  /// T1: the TCP is watched for 250 mm/s (without geometry: 6 % of the axes' speeds). Turning the
  /// switch stops whatever runs.
  void mode(OperatingMode mode);
  void set_override(int percent);  ///< $OV_PRO, 0..100: it does not scale corrections
  void start_key(bool held);  ///< counts in T1 and T2
  /// The contact input from t on; packets have it as it is at their tick. Off at power on.
  void input(drivers::TimePoint t, bool on);
  void cancel_program();

  /// Faults. The arm keeps its position although the setpoint moves (drives off, brake closed).
  void block_drives(bool blocked);
  /// Sets the arm to a pose; only while RSI does not run.
  void place(const std::vector<double>& pose_rad);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::sim
