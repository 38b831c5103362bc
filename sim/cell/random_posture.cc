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

calib::JointVector random_posture(const calib::Robot& robot, calib::Random& random,
                                  const Eigen::Vector3d& at) {
  calib::JointVector q(robot.joints.size(), 0.0);
  q[0] = robot.joints[0].sign * std::atan2(at.y(), at.x());
  if (q.size() >= 6) q[1] = -1.2, q[2] = 1.6, q[4] = 1.0;
  for (std::size_t i = 1; i < q.size(); ++i) {
    const double spread = i < 3 ? 0.4 : 1.5;
    q[i] += random.uniform(-spread, spread);
  }
  for (std::size_t i = 0; i < q.size(); ++i)
    q[i] = std::clamp(q[i], robot.joints[i].min_rad, robot.joints[i].max_rad);
  return q;
}

}  // namespace cellcal::sim
