#pragma once
// Postures of the arm at rest with the TCP that the controller states for each.

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
  void look(const drivers::RobotState& robot);
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

}  // namespace cellcal::daemon
