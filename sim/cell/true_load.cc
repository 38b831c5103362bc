#include "sim/cell/true_load.h"

#include <algorithm>
#include <cmath>

namespace cellcal::sim {

namespace {

constexpr double kLeastKgPerM = 25.0, kMostKgPerM = 60.0;
constexpr double kBesideM = 0.04;

}  // namespace

void hang_masses(calib::Robot& robot, calib::Random& random) {
  if (std::any_of(robot.joints.begin(), robot.joints.end(),
                  [](const calib::Joint& joint) { return joint.mass_kg > 0.0; }))
    return;
  for (std::size_t i = 1; i < robot.joints.size(); ++i) {
    calib::Joint& joint = robot.joints[i];
    joint.mass_kg = std::hypot(joint.a_m, joint.d_m) * random.uniform(kLeastKgPerM, kMostKgPerM);
    // From the frame after the link back to the preceding joint.
    const Eigen::Matrix3d turn = (Eigen::AngleAxisd(joint.alpha_rad, Eigen::Vector3d::UnitX()) *
                                  Eigen::AngleAxisd(joint.beta_rad, Eigen::Vector3d::UnitY()))
                                     .toRotationMatrix();
    const Eigen::Vector3d back = turn.transpose() * Eigen::Vector3d(-joint.a_m, 0.0, -joint.d_m);
    joint.com_m = random.uniform(0.2, 0.8) * back;
    for (double& component : joint.com_m) component += random.uniform(-kBesideM, kBesideM);
  }
}

}  // namespace cellcal::sim
