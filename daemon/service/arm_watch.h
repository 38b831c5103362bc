#pragma once
// The arm's motion as the newest packet of the controller shows it, and nothing beyond that packet.

#include <optional>

#include "daemon/service/status.h"
#include "drivers/robot.h"
#include "drivers/time.h"

namespace cellcal::daemon {

/// Made of one look at the robot's state after the other. Not thread-safe.
class ArmWatch {
 public:
  void look(const drivers::RobotState& robot, drivers::TimePoint now);
  ArmSeen seen(drivers::TimePoint now) const;

 private:
  drivers::AxisAngles posture_;  ///< what the next look is compared with
  drivers::TimePoint posture_at_{};
  std::optional<drivers::TimePoint> packet_at_;  ///< the look that brought the newest packet
  std::uint64_t packets_ = 0;
  bool driven_ = false;         ///< by a move, at the look before
  std::optional<bool> moving_;  ///< none: the link is lost, or one packet alone shows no motion
};

}  // namespace cellcal::daemon
