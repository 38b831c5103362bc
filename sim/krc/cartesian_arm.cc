#include "sim/krc/cartesian_arm.h"

#include <Eigen/Geometry>
#include <cmath>

#include "calib/model/inverse.h"
#include "calib/model/kinematics.h"
#include "calib/model/robot.h"
#include "drivers/units.h"

namespace cellcal::sim {
namespace {

using drivers::kRadPerDeg;
constexpr double kMPerMm = 1e-3;

// KUKA: A about Z, then B about the new Y, then C about the new X.
Eigen::Isometry3d to_pose(const KukaFrame& f) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = kMPerMm * Eigen::Vector3d(f[0], f[1], f[2]);
  pose.linear() = (Eigen::AngleAxisd(f[3] * kRadPerDeg, Eigen::Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(f[4] * kRadPerDeg, Eigen::Vector3d::UnitY()) *
                   Eigen::AngleAxisd(f[5] * kRadPerDeg, Eigen::Vector3d::UnitX()))
                      .toRotationMatrix();
  return pose;
}

KukaFrame to_frame(const Eigen::Isometry3d& pose) {
  const Eigen::Matrix3d r = pose.linear();
  const double across = std::hypot(r(0, 0), r(1, 0));
  // At B = 90 deg only the sum of A and C is determined.
  const bool lost = across < 1e-9;
  const double a = lost ? 0.0 : std::atan2(r(1, 0), r(0, 0));
  const double b = std::atan2(-r(2, 0), across);
  const double c = lost ? std::atan2(-r(1, 2), r(1, 1)) : std::atan2(r(2, 1), r(2, 2));
  const Eigen::Vector3d mm = pose.translation() / kMPerMm;
  return {mm.x(), mm.y(), mm.z(), a / kRadPerDeg, b / kRadPerDeg, c / kRadPerDeg};
}

class ModelArm final : public CartesianArm {
 public:
  explicit ModelArm(const calib::Cell& cell) : arm_(cell.robot, cell.tool) {}

  KukaFrame frame(std::span<const double> axis_rad) const override {
    return to_frame(arm_.nominal_tcp(own(axis_rad)));
  }

  std::optional<std::vector<double>> axes(const KukaFrame& tcp,
                                          const std::vector<double>& near_rad) const override {
    const auto near = own(near_rad);
    return calib::inverse(arm_, to_pose(tcp), {near.begin(), near.end()}, 0.0);
  }

  std::optional<std::vector<double>> corrected(std::span<const double> start_rad,
                                               const KukaFrame& correction, CorrectionFrame system,
                                               const std::vector<double>& near_rad) const override {
    const Eigen::Isometry3d start = arm_.nominal_tcp(own(start_rad));
    const Eigen::Isometry3d by = to_pose(correction);
    Eigen::Isometry3d target = start * by;
    if (system == CorrectionFrame::kBase) {
      target.linear() = by.linear() * start.linear();
      target.translation() = start.translation() + by.translation();
    }
    const auto near = own(near_rad);
    return calib::inverse(arm_, target, {near.begin(), near.end()}, 0.0);
  }

 private:
  std::span<const double> own(std::span<const double> axis_rad) const {
    return axis_rad.first(arm_.robot().joints.size());
  }

  calib::ArmModel arm_;
};

}  // namespace

std::shared_ptr<const CartesianArm> make_cartesian_arm(const calib::Cell& cell) {
  if (cell.robot.joints.size() != cell.robot.first_turning() + 6) return nullptr;
  return std::make_shared<ModelArm>(cell);
}

}  // namespace cellcal::sim
