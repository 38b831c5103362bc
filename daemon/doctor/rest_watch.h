#pragma once
// Postures for the controller's model, of an arm that is only observed: a person may jog it.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

#include "daemon/config/config.h"
#include "daemon/runner/stated_poses.h"
#include "drivers/robot.h"

namespace cellcal::daemon {

/// Postures that the arm kept for a while.
class RestWatch {
 public:
  RestWatch(const calib::Cell& cell, const DaemonConfig& config)
      : poses_(cell.robot, stated_frames(config, cell)) {}

  void look(const drivers::RobotState& robot) {
    const auto now = std::chrono::steady_clock::now();
    if (!at_ || moved(robot.actual_rad)) {
      at_ = robot.actual_rad;
      since_ = now;
    }
    if (now - since_ >= kRest) poses_.look(robot);
  }
  calib::ControllerModel judge() { return poses_.judge(); }

 private:
  static constexpr std::chrono::milliseconds kRest{300};
  static constexpr double kStillRad = 2e-4;  // 0.01 deg

  bool moved(const drivers::AxisAngles& now) const {
    return !std::equal(now.begin(), now.end(), at_->begin(), at_->end(),
                       [](double a, double b) { return std::abs(a - b) < kStillRad; });
  }

  StatedPoses poses_;
  std::optional<drivers::AxisAngles> at_;
  std::chrono::steady_clock::time_point since_{};
};

}  // namespace cellcal::daemon
