#pragma once
// A KUKA controller that serves EKI channel files of other people: the plain program that most of
// them come with, told by the names of the elements. States go out about 50 times a second;
// commands are taken one after the other.
//
// Elements are known by their last names. Received: A1..A6, E1.. axis angles [deg]; X Y Z A B C the
// TCP [mm, deg]; RobotCommand/Type, beside RobotCommand/Axis and RobotCommand/Cart: 1 PTP to angles,
// 2 PTP and 3 LIN to the TCP, 4 and 5 the same relative (without a Type: 1, or 2 where there are no
// angles). A Type under any other name is somebody else's, its codes are not known, and nothing is
// moved by such commands. Velocity up to 1, or percent. Sent: angles
// and TCP likewise, under a name with "vel" in percent of the axis' speed, "eff" or "torque" 0; S
// and T; Size, how many commands wait. Others: 0.
//
// Model: every axis runs to its target with its speed and acceleration, not in step with the
// others; LIN is no line. Without a Type commands are blended (C_PTP): the next is taken 2 deg
// before the target, otherwise at rest. What is not here: programs that answer each telegram in
// their own way.

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
  std::vector<double> min_rad, max_rad;  ///< a target outside is left out; empty: none
  double lag_s = 0.02;                   ///< setpoint to arm
  int cycle_ms = 4;
  int state_ms = 20;
  std::shared_ptr<const CartesianArm> arm;  ///< none: TCP is 0, targets of it are left out
};

/// Whether the file is of the kind that cellcal's own programs serve (EkiController).
bool is_cellcal_channel(const EkiChannelConfig& channel);

class EkiStream {
 public:
  /// Throws std::invalid_argument.
  explicit EkiStream(EkiStreamConfig config);
  ~EkiStream();
  EkiStream(const EkiStream&) = delete;
  EkiStream& operator=(const EkiStream&) = delete;

  void tick(drivers::TimePoint now);
  drivers::Duration cycle() const;

  // ---- network: a client may come and go on each channel
  std::size_t channels() const;
  EkiChannel& channel(std::size_t i);
  /// One datagram of a UDP channel. A sender is a client from its first one on.
  void datagram(std::size_t i, std::string_view bytes);

  std::vector<double> actual_rad_at(drivers::TimePoint t) const;
  std::vector<double> setpoint_rad() const;
  bool at_rest() const;
  std::uint64_t moves() const;         ///< commands carried out
  const std::string& message() const;  ///< why the last command was left out; empty: it was not

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::sim
