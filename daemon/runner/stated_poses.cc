#include "daemon/runner/stated_poses.h"

#include "calib/model/units.h"

namespace cellcal::daemon {

namespace {

constexpr std::size_t kMostPoses = 200;
/// Confirmations of one touch are one posture.
constexpr double kAnotherRad = 0.5 * calib::kRadPerDeg;

bool alike(const calib::JointVector& a, const calib::JointVector& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](double x, double y) { return std::abs(x - y) < kAnotherRad; });
}

}  // namespace

std::optional<calib::StatedPose> stated_pose(const drivers::RobotState& robot) {
  if (!robot.stated_tcp) return std::nullopt;
  const drivers::StatedTcp& tcp = *robot.stated_tcp;
  calib::StatedPose pose;
  pose.joint_rad.assign(robot.actual_rad.begin(), robot.actual_rad.end());
  pose.tcp.translation() = Eigen::Vector3d(tcp[0], tcp[1], tcp[2]);
  pose.tcp.linear() = (Eigen::AngleAxisd(tcp[3], Eigen::Vector3d::UnitZ()) *
                       Eigen::AngleAxisd(tcp[4], Eigen::Vector3d::UnitY()) *
                       Eigen::AngleAxisd(tcp[5], Eigen::Vector3d::UnitX()))
                          .toRotationMatrix();
  return pose;
}

void StatedPoses::observe(const drivers::RobotState& robot) {
  auto pose = stated_pose(robot);
  if (!pose || pose->joint_rad.size() != robot_.joints.size() + robot_.positioner.size()) return;
  pose->joint_rad.resize(robot_.joints.size());
  // The frame between the unit and the arm's root is not known from the controller's files.
  if (robot_.first_turning() > 0) return;
  const std::lock_guard lock(mutex_);
  if (poses_.size() >= kMostPoses) return;
  if (!poses_.empty() && alike(poses_.back().joint_rad, pose->joint_rad)) return;
  poses_.push_back(std::move(*pose));
}

calib::ControllerModel StatedPoses::judge() {
  std::vector<calib::StatedPose> poses;
  {
    const std::lock_guard lock(mutex_);
    if (poses_.size() == judged_.postures) return judged_;
    poses = poses_;
  }
  calib::Robot arm = robot_;  // in the base, wherever a positioner stands
  arm.positioner.clear();
  const calib::ControllerModel model = calib::compare_controller_model(arm, poses, known_);
  const std::lock_guard lock(mutex_);
  return judged_ = model;
}

calib::ControllerModel StatedPoses::judged() const {
  const std::lock_guard lock(mutex_);
  return judged_;
}

}  // namespace cellcal::daemon
