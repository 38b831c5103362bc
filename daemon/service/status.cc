#include "daemon/service/status.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "calib/model/units.h"

namespace cellcal::daemon {

namespace {

/// Five status samples of an open link. A link that declares its packets lost sooner takes precedence.
constexpr std::chrono::milliseconds kFresh{1000};
/// Minimum time between two compared postures: noise in the last decimals of AIPos at rest is no motion then.
constexpr std::chrono::milliseconds kBetweenPostures{150};
constexpr double kRestSpeedRadS = 0.1 / calib::kDegPerRad;

double farthest_rad(const drivers::AxisAngles& a, const drivers::AxisAngles& b) {
  double farthest = 0.0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    farthest = std::max(farthest, std::abs(a[i] - b[i]));
  return farthest;
}

}  // namespace

void ArmWatch::update(const drivers::RobotState& robot, drivers::TimePoint now) {
  const bool up =
      robot.link == drivers::RobotLink::kNotReferenced || robot.link == drivers::RobotLink::kReady;
  if (!up) {  // closed, or lost by the link's own limit; the packet age keeps growing
    posture_.clear();
    moving_.reset();
    return;
  }
  if (packet_at_ && robot.packets == packets_) return;
  packets_ = robot.packets;
  packet_at_ = now;
  if (robot.moving || posture_.size() != robot.actual_rad.size()) {
    if (robot.moving) moving_ = true;
  } else if (driven_) {
    moving_ = false;  // the driver has confirmed rest
  } else if (now - posture_at_ < kBetweenPostures) {
    return;
  } else {
    const double over_s = std::chrono::duration<double>(now - posture_at_).count();
    moving_ = farthest_rad(posture_, robot.actual_rad) > kRestSpeedRadS * over_s;
  }
  driven_ = robot.moving;
  posture_ = robot.actual_rad;
  posture_at_ = now;
}

ArmSeen ArmWatch::seen(drivers::TimePoint now) const {
  if (!packet_at_) return {};
  const double age_s = std::max(0.0, std::chrono::duration<double>(now - *packet_at_).count());
  if (!moving_ || now - *packet_at_ > kFresh) return {ArmMotion::kUnknown, age_s};
  return {*moving_ ? ArmMotion::kMoving : ArmMotion::kAtRest, age_s};
}

}  // namespace cellcal::daemon
