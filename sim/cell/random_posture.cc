#include "sim/cell/random_posture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace cellcal::sim {

Eigen::Matrix3d random_orientation(const calib::Tool& tool, calib::Random& random,
                                   const Eigen::Vector3d& normal, double cone_rad) {
  const double pi = std::numbers::pi;
  const Eigen::Vector3d shaft = tool.tcp.translation().normalized();
  const Eigen::AngleAxisd roll(random.uniform(-pi, pi), -normal);
  const Eigen::AngleAxisd heading(random.uniform(-pi, pi), normal);
  const Eigen::AngleAxisd tilt(cone_rad * std::sqrt(random.uniform()),
                               heading * normal.unitOrthogonal());
  return (tilt * roll).toRotationMatrix() *
         Eigen::Quaterniond::FromTwoVectors(shaft, -normal).toRotationMatrix() * tool.tcp.linear();
}

calib::JointVector facing(const calib::Robot& robot, calib::JointVector posture,
                          const Eigen::Vector3d& place_m) {
  const std::size_t arm = robot.first_turning();
  Eigen::Vector3d off = place_m;
  if (arm > 0) {
    const calib::Joint& track = robot.joints[0];
    const Eigen::Vector3d along = robot.base_fixed.linear() * track.guide->along;
    off -= robot.base_fixed.translation();
    posture[0] = std::clamp(along.dot(off), track.min_rad, track.max_rad);
    off -= posture[0] * along;
  }
  const calib::Joint& first = robot.joints[arm];
  posture[arm] =
      std::clamp(first.sign * std::atan2(off.y(), off.x()), first.min_rad, first.max_rad);
  return posture;
}

calib::JointVector random_posture(const calib::Robot& robot, calib::Random& random,
                                  const Eigen::Vector3d& at) {
  calib::JointVector q(robot.joints.size(), 0.0);
  const std::size_t arm = robot.first_turning();
  if (q.size() >= arm + 6) q[arm + 1] = -1.2, q[arm + 2] = 1.6, q[arm + 4] = 1.0;
  q = facing(robot, q, at);
  if (arm > 0) q[0] += random.uniform(-0.4, 0.4);
  for (std::size_t i = arm + 1; i < q.size(); ++i) {
    const double spread = i < arm + 3 ? 0.4 : 1.5;
    q[i] += random.uniform(-spread, spread);
  }
  for (std::size_t i = 0; i < q.size(); ++i)
    q[i] = std::clamp(q[i], robot.joints[i].min_rad, robot.joints[i].max_rad);
  return q;
}

}  // namespace cellcal::sim
