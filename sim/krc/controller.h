#pragma once
// A KUKA controller as RSI shows it, without sockets, threads or clock: hard cycle, late counting,
// time-out stop, absolute axis correction with clamp and monitor, a lagging arm.
//
// Model: the setpoint of one cycle is the start pose plus the correction accepted last; each axis
// follows it as a first-order lag, integrated exactly. Gravity, servo ripple and the mechanical
// path after a stop are not modelled: a stopped arm rests where it is.

#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/robot.h"
#include "drivers/time.h"

namespace cellcal::sim {

struct ControllerConfig {
  std::vector<double> start_rad{0.0, -1.5707963267948966, 1.5707963267948966,
                                0.0, 1.5707963267948966,  0.0};  ///< KUKA's home pose
  int cycle_ms = 4;                                              ///< 4 (#IPO_FAST) or 12 (#IPO)
  double lag_s = 0.02;  ///< time constant, setpoint to actual position; 10..40 ms is usual
  int precision = 4;    ///< decimals of the packets; KUKA's default is 1
  std::string sentype = "ImFree";
  std::string axis_tag = "AK";
  std::string stop_tag = "Stop";
  int timeout_cycles = 100;             ///< late replies tolerated before KSS29002
  bool timeout_counts_total = false;    ///< which one KUKA means is stated nowhere
  bool hold_on = true;                  ///< false: a late reply lets the correction fall to 0
  bool send_setpoint = true;            ///< DEF_ASPos wired
  bool send_delay = true;               ///< DEF_Delay wired
  bool first_frame_only_ipoc = false;   ///< RSI 2's habit
  double clamp_deg = 90.0;              ///< AXISCORR's limit: clamps in silence
  double monitor_deg = 90.0;            ///< AXISCORRMON: stops with KSS29000
  std::vector<double> max_speed_rad_s;  ///< per axis, 'Command velocity' fault; empty: no check
  double noise_sigma_deg = 0.0;         ///< of the reported AIPos alone
  std::uint64_t seed = 1;
  std::uint64_t ipoc_start = 1'000'000;
  int ipoc_step = 0;  ///< per packet; 0: the cycle's milliseconds
};

enum class RsiPhase { kBeforeRsiOn, kRunning, kEnded, kFaulted };

class Controller {
 public:
  explicit Controller(ControllerConfig config);
  ~Controller();
  Controller(const Controller&) = delete;
  Controller& operator=(const Controller&) = delete;

  /// RSI_ON in the pose where the arm stands: correction 0, Delay 0. Also restarts after a fault.
  void rsi_on();
  /// The next cycle, at `now` (the caller keeps the hard clock). Returns the datagram to send,
  /// valid until the next call; empty while RSI does not run.
  std::string_view tick(drivers::TimePoint now);
  /// A reply from the PC, taken into account at the next tick if SENTYPE and IPOC are right.
  void receive(std::string_view reply);

  /// True position of the arm [rad] at t, from the last tick up to the next: what the setpoint now
  /// in force makes of it.
  std::vector<double> actual_rad_at(drivers::TimePoint t) const;
  std::vector<double> setpoint_rad() const;    ///< start pose plus correction in force
  std::vector<double> correction_deg() const;  ///< in force, clamped

  RsiPhase phase() const;
  const std::string& message() const;  ///< pendant's text after a fault or an end; else empty
  std::uint64_t late() const;          ///< replies late or not accepted, in this session: Delay
  std::uint64_t late_ever() const;
  std::uint64_t packets() const;  ///< sent, in this session
  std::uint64_t ipoc() const;
  drivers::Duration cycle() const;

  /// Faults. The arm keeps its position although the setpoint moves (drives off, brake closed).
  void block_drives(bool blocked);
  /// Sets the arm to a pose; only while RSI does not run.
  void place(const std::vector<double>& pose_rad);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::sim
