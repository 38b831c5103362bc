#pragma once
// A KUKA controller that serves EKI channel files of other software: the simple program that most of
// them include, identified by the names of the elements. States are sent about 50 times a second;
// commands are processed in order.
//
// Elements are identified by their last names. Received: A1..A6, E1.. axis angles [deg]; X Y Z A B C
// the TCP [mm, deg]; RobotCommand/Type, with RobotCommand/Axis and RobotCommand/Cart: 1 PTP to
// angles, 2 PTP and 3 LIN to the TCP, 4 and 5 the same relative (without a Type: 1, or 2 if there
// are no angles). A Type under any other name has unknown codes, and such commands cause no motion.
// Velocity up to 1, or percent. Sent: angles and TCP likewise, under a name with "vel" in percent of
// the axis' speed, "eff" or "torque" 0; S and T; Size, the number of queued commands. Others: 0.
//
// Model: every axis moves to its target with its own speed and acceleration, not synchronised; LIN
// is not a straight line. Without a Type commands are blended (C_PTP): the next starts 2 deg before
// the target, otherwise at rest. Not covered: programs that answer each telegram individually.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "drivers/time.h"
#include "sim/krc/cartesian_arm.h"
#include "sim/krc/eki_channel.h"

namespace cellcal::sim {

struct EkiStreamConfig {
  std::vector<std::string> channel_xml;  ///< one file, or one for commands and one for states
  std::vector<double> start_rad{0.0, -1.5707963267948966, 1.5707963267948966,
                                0.0, 1.5707963267948966,  0.0};
  std::vector<double> max_speed_rad_s;  ///< per axis; empty: 3 rad/s
  double max_acceleration_rad_s2 = 10.0;
  std::vector<double> min_rad, max_rad;  ///< targets outside are ignored; empty: none
  double lag_s = 0.02;                   ///< setpoint to arm
  int cycle_ms = 4;
  int state_ms = 20;
  std::shared_ptr<const CartesianArm> arm;  ///< null: TCP is 0, its targets are ignored
};

/// True if the file is of the kind served by cellcal's own programs (EkiController).
bool is_cellcal_channel(const EkiChannelConfig& channel);

class EkiStream {
 public:
  /// Throws std::invalid_argument.
  explicit EkiStream(EkiStreamConfig config);
  ~EkiStream();

  void tick(drivers::TimePoint now);
  drivers::Duration cycle() const;

  // ---- network: a client may connect and disconnect on each channel
  std::size_t channels() const;
  EkiChannel& channel(std::size_t i);
  /// One datagram of a UDP channel. A sender is a client from its first one on.
  void datagram(std::size_t i, std::string_view bytes);

  std::vector<double> actual_rad_at(drivers::TimePoint t) const;
  std::vector<double> setpoint_rad() const;
  bool at_rest() const;
  std::uint64_t moves() const;         ///< commands executed
  const std::string& message() const;  ///< reason why the last command was ignored; empty: executed

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::sim
