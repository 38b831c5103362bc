#pragma once
// Speed bound for operation with a person inside the cell: in T1 the controller stops an arm under RSI above
// 250 mm/s at the TCP or the flange, and the override does not scale RSI corrections.

#include <memory>
#include <vector>

#include "calib/model/kinematics.h"
#include "drivers/robot.h"

namespace cellcal::daemon {

class HandSpeed {
 public:
  struct Bound {
    double speed_m_s = 0.0;     ///< of TCPs, flange and joint origins; 0: unbounded
    bool mode_unknown = false;  ///< applies in T1, and also where the link does not report the mode
  };
  /// `speed_fraction`: share of the robot file's axis speeds, as configured for the link.
  HandSpeed(std::shared_ptr<const calib::ArmModel> arm, double speed_fraction, Bound bound);

  /// Share of each axis' speed limit for this move from the commanded position (Move::speed_share). 1 for
  /// moves with a speed of their own: searches, and straight lines with a duration.
  double share(const drivers::Move& move, const drivers::RobotState& robot) const;

 private:
  double share_of_leg(const std::vector<double>& from, const std::vector<double>& to) const;

  std::shared_ptr<const calib::ArmModel> arm_;
  double speed_fraction_;
  Bound bound_;
};

}  // namespace cellcal::daemon
