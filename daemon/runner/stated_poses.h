#pragma once
// Postures of the arm at rest with the TCP that the controller states for each.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <optional>
#include <vector>

#include "calib/check/controller_model.h"
#include "drivers/robot.h"

namespace cellcal::daemon {

/// None: the controller states no TCP.
std::optional<calib::StatedPose> stated_pose(const drivers::RobotState& robot);

/// Thread-safe.
class StatedPoses {
 public:
  StatedPoses(calib::Robot robot, calib::StatedFrames known)
      : robot_(std::move(robot)), known_(std::move(known)) {}

  /// The arm is at rest. A posture like the newest one, and those beyond kMostPoses, are not kept.
  void observe(const drivers::RobotState& robot);
  /// Compares all postures so far; not for a thread with deadlines.
  calib::ControllerModel judge();
  /// Newest judgement.
  calib::ControllerModel judged() const;
  const calib::Robot& robot() const { return robot_; }

 private:
  const calib::Robot robot_;
  const calib::StatedFrames known_;
  mutable std::mutex mutex_;
  std::vector<calib::StatedPose> poses_;
  calib::ControllerModel judged_;
};

// Postures for the controller's model, of an arm that is only observed: a person may jog it.

/// Postures that the arm kept for a while.
class RestWatch {
 public:
  RestWatch(calib::Robot robot, calib::StatedFrames known)
      : poses_(std::move(robot), std::move(known)) {}

  void update(const drivers::RobotState& robot) {
    const auto now = std::chrono::steady_clock::now();
    if (!at_ || moved(robot.actual_rad)) {
      at_ = robot.actual_rad;
      since_ = now;
    }
    if (now - since_ >= kRest) poses_.observe(robot);
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
