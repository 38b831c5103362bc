#pragma once
// The bound of the arm's speed while a person stands beside it: T1 stops an arm over RSI above 250 mm/s
// at the TCP or the flange, and no override slows RSI down.

#include <memory>
#include <vector>

#include "calib/model/kinematics.h"
#include "drivers/robot.h"

namespace cellcal::daemon {

class HandSpeed {
 public:
  struct Bound {
    double speed_m_s = 0.0;     ///< of TCPs, flange and joints' origins; 0: none
    bool mode_unknown = false;  ///< applies also where the link does not tell the mode, beside T1
  };
  /// `speed_fraction`: of the robot file's axis speeds, as the link is configured.
  HandSpeed(std::shared_ptr<const calib::ArmModel> arm, double speed_fraction, Bound bound);

  /// Of each axis' speed limit, for this move from where the arm is commanded to (Move::speed_share).
  /// 1 for what goes at a speed of its own: searches, and straight lines with a duration.
  double share(const drivers::Move& move, const drivers::RobotState& robot) const;

 private:
  double share_of_leg(const std::vector<double>& from, const std::vector<double>& to) const;

  std::shared_ptr<const calib::ArmModel> arm_;
  double speed_fraction_;
  Bound bound_;
};

}  // namespace cellcal::daemon
