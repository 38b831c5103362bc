#pragma once
// Configuration of a cell's EKI link.

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/robot.h"

namespace cellcal::drivers {

/// Stop mechanism of a search.
enum class EkiStop {
  kInput,  ///< contact on a digital input of the controller: its interrupt latches $AXIS_INT
  kFlag,   ///< contact known to this computer only: a telegram sets a flag on the controller
};

struct EkiConfig {
  std::string address = "172.31.1.147";  ///< controller's address in the KLI network
  std::uint16_t port = 54600;            ///< 54600..54615 pass the controller's firewall
  EkiStop stop = EkiStop::kInput;
  /// The link is lost after this time without a state: ten states of 20 ms, and more than one TCP
  /// retransmission.
  double silence_s = 0.25;
  /// Period of the alive telegrams; the controller's dead man expires after 0.25 s.
  double beat_s = 0.04;
  /// Maximum number of unconfirmed telegrams. Three more are reserved for stops; the sum is below
  /// the channel's BUFFERING limit, beyond which the controller closes the connection.
  int window = 4;

  /// Time from contact to the position in $AXIS_INT, compensated along the search: the input's
  /// filter, and the servo lag if the release latches the setpoint. Determined as the slope of
  /// touches of one point at two speeds. May be negative.
  double latch_delay_s = 0.0;
  double latch_jitter_s = 0.004;  ///< 1 sigma, from the sampling of the controller's input
  /// 1 sigma of the time stamps of the states between which a contact is interpolated (kFlag).
  double flag_sigma_s = 0.010;
  /// Searches with a faster axis are refused (kFlag): 50 to 70 ms pass from contact to BRAKE, so at
  /// 1 deg/s and 1 m of reach the tip travels a further millimetre.
  double flag_search_limit_deg_s = 1.0;

  /// In EXT, requests the controller to start CELLCAL_EKI if it does not run. The controller complies
  /// if its files permit it (CC_MAY_RUN) and no program is selected.
  bool run_program = false;

  /// E1 to En of the channel. Those without a limit hold still: their position at the reference is
  /// part of every command, and a change is a failure.
  int external_axes = 0;
  std::vector<AxisLimit> limits;  ///< one per axis; acceleration and jerk are set on the controller
  std::vector<double> full_speed_rad_s;  ///< of each axis at 100 percent
  double follow_tolerance_deg = 0.05;    ///< largest deviation from the target at the end of a move

  /// Axes of the channel.
  std::size_t wire_axes() const;
  /// Percentage of the axis speeds at which no axis exceeds its limit, 1..100; between these angles without
  /// axes behind the arm's six that stand.
  int transit_percent(const AxisAngles& from_rad = {}, const AxisAngles& to_rad = {}) const;
  /// Throws ConfigError naming key, value and remedy.
  void validate() const;
};

}  // namespace cellcal::drivers
