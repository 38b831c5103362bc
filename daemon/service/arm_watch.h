#pragma once
// Motion of the arm as reported by the newest controller packet; nothing is extrapolated beyond that packet.

#include <optional>

#include "daemon/service/status.h"
#include "drivers/robot.h"
#include "drivers/time.h"

namespace cellcal::daemon {

/// Accumulates successive samples of the robot state. Not thread-safe.
class ArmWatch {
 public:
  void look(const drivers::RobotState& robot, drivers::TimePoint now);
  ArmSeen seen(drivers::TimePoint now) const;

 private:
  drivers::AxisAngles posture_;  ///< reference for the next sample
  drivers::TimePoint posture_at_{};
  /// Time of the sample that brought the newest packet.
  std::optional<drivers::TimePoint> packet_at_;
  std::uint64_t packets_ = 0;
  bool driven_ = false;         ///< moved by a command, at the previous sample
  std::optional<bool> moving_;  ///< none: link lost, or a single packet, which shows no motion
};

}  // namespace cellcal::daemon
