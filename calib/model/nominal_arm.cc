#include "calib/model/nominal_arm.h"

namespace cellcal::calib {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

NominalArm::NominalArm(const Robot& robot, const Isometry3d& tcp) : base_(robot.base_fixed) {
  for (const Joint& joint : robot.joints) {
    Isometry3d behind = Isometry3d::Identity();
    behind.translate(Vector3d(joint.a_m, 0.0, joint.d_m));
    behind.rotate(AngleAxisd(joint.alpha_rad, Vector3d::UnitX()));
    behind.rotate(AngleAxisd(joint.beta_rad, Vector3d::UnitY()));
    std::optional<Vector3d> along;
    if (joint.guide) along = joint.guide->along;
    joints_.push_back({static_cast<double>(joint.sign), joint.offset_rad, along, behind});
  }
  if (!joints_.empty()) joints_.back().behind = joints_.back().behind * robot.flange_fixed * tcp;
}

Isometry3d NominalArm::tcp(std::span<const double> joint_rad) const noexcept {
  Isometry3d pose = base_;
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    if (joints_[i].along) {
      pose.translate(joint_rad[i] * *joints_[i].along);
      pose = pose * joints_[i].behind;
      continue;
    }
    pose.rotate(AngleAxisd(joints_[i].sign * joint_rad[i] + joints_[i].offset_rad,  //
                           Vector3d::UnitZ()));
    pose = pose * joints_[i].behind;
  }
  return pose;
}

}  // namespace cellcal::calib
