#include "calib/estimate/carried_poses.h"

#include <algorithm>

#include "calib/model/inverse.h"
#include "calib/model/linear.h"

namespace cellcal::calib {

namespace {

constexpr double kHalfM = 0.15;

/// Centres of the targets that at least so many axes carry, and the number of these.
struct CarriedCentre {
  Eigen::Vector3d centre_m;
  std::size_t axes;
};

std::vector<CarriedCentre> carried_centres(const Calibration& c, int axes) {
  std::vector<CarriedCentre> centres;
  for (const TargetResult& target : c.targets) {
    const auto stated = std::ranges::find(c.cell.targets, target.id, &Target::id);
    if (stated != c.cell.targets.end() && stated->carried_by >= axes)
      centres.push_back({target.centre_m, static_cast<std::size_t>(stated->carried_by)});
  }
  return centres;
}

Eigen::Vector3d within(double half_m, Random& random) {
  Eigen::Vector3d offset;
  for (double& one : offset) one = random.uniform(-half_m, half_m);
  return offset;
}

Eigen::Matrix3d any_orientation(Random& random) {
  Eigen::Quaterniond q;
  for (double& one : q.coeffs()) one = random.normal();
  return q.normalized().toRotationMatrix();
}

}  // namespace

std::vector<CarriedPose> carried_poses(const ArmModel& arm, const Calibration& calibration,
                                       int axes, int count, unsigned seed) {
  constexpr int kAttempts = 50;  // per pose: most orientations of a long tool are out of reach
  const std::vector<CarriedCentre> centres = carried_centres(calibration, axes);
  std::vector<CarriedPose> poses;
  if (axes == 0 || centres.empty()) return poses;
  const Configurations ways(arm, 0.0);
  const Robot& robot = arm.robot();
  Random random(seed);
  for (int k = 0; k < kAttempts * count && static_cast<int>(poses.size()) < count; ++k) {
    std::vector<double> angles;
    for (const PositionerAxis& axis : robot.positioner)
      angles.push_back(random.uniform(axis.min_rad, axis.max_rad));
    const CarriedCentre& centre = centres[random.below(centres.size())];
    const Eigen::Isometry3d table = carried_at(robot, std::span(angles).first(centre.axes));
    Eigen::Isometry3d tcp(any_orientation(random));
    tcp.translation() = table * (centre.centre_m + within(kHalfM, random));
    const Joint& first = robot.joints[0];
    const double track_m =
        first.is_prismatic() ? random.uniform(first.min_rad, first.max_rad) : 0.0;
    std::vector<JointVector> reached = ways.reach(tcp, track_m);
    if (reached.empty()) continue;
    angles.resize(static_cast<std::size_t>(axes));
    poses.push_back({std::move(reached[random.below(reached.size())]), std::move(angles)});
  }
  return poses;
}

}  // namespace cellcal::calib
