#pragma once
// What a cell sets about its EKI link.

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/robot.h"

namespace cellcal::drivers {

/// What stops a search.
enum class EkiStop {
  kInput,  ///< contact on a digital input of the controller: its interrupt latches $AXIS_INT
  kFlag,   ///< contact known to this computer alone: a telegram sets a flag on the controller
};

struct EkiConfig {
  std::string address = "172.31.1.147";  ///< the controller's, in its KLI network
  std::uint16_t port = 54600;            ///< 54600..54615 pass the controller's firewall
  EkiStop stop = EkiStop::kInput;
  /// No state for this long means 'lost'. Ten states of 20 ms, and more than one repeat of TCP.
  double silence_s = 0.25;
  /// How often the controller hears that this computer is alive; its dead man waits for 0.25 s.
  double beat_s = 0.04;
  /// Telegrams that the controller has not confirmed. Three more are kept for stops; the sum stays
  /// below the channel's BUFFERING limit, beyond which the controller closes the connection.
  int window = 4;

  /// From contact to the position that $AXIS_INT holds, taken off along the search: the input's
  /// filter, and the servo lag if the release latches the setpoint. The slope of touches of one
  /// point at two speeds. May be negative.
  double latch_delay_s = 0.0;
  double latch_jitter_s = 0.004;  ///< 1 sigma of it: how evenly the controller samples its input
  /// 1 sigma of the instants of the states between which a contact is interpolated (kFlag).
  double flag_sigma_s = 0.010;
  /// Searches faster than this at their fastest axis are refused (kFlag): 50 to 70 ms pass from
  /// contact to BRAKE, so at 1 deg/s and 1 m of reach the tip goes on for a millimetre.
  double flag_search_limit_deg_s = 1.0;

  /// In EXT, where CELLCAL_EKI does not run, the controller is asked to start it. It does so where its
  /// files permit it (CC_MAY_RUN) and no program is selected.
  bool run_program = false;

  std::vector<AxisLimit> limits;  ///< one per axis; acceleration and jerk are the controller's
  std::vector<double> full_speed_rad_s;  ///< of each axis at 100 percent
  double follow_tolerance_deg = 0.05;    ///< a move that ends farther from its target has failed

  /// Percent of the axis speeds at which no axis exceeds its limit, 1..100.
  int transit_percent() const;
  /// Throws ConfigError naming the key, the value and what to do.
  void validate() const;
};

}  // namespace cellcal::drivers
