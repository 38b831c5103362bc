#include "calib/uncertainty/predict.h"

#include "calib/model/kinematics.h"
#include "calib/result/arm_values.h"
#include "calib/uncertainty/bound.h"
#include "calib/uncertainty/region.h"

namespace cellcal::calib {

struct Predictor::Impl {
  ArmModel arm;
  Eigen::VectorXd x;
  Eigen::MatrixXd sigma;  ///< covariance of the arm's parameters, SI
  PositionBound bound;

  Impl(const Calibration& c, const Cell& levelled)
      : arm(levelled),
        x(arm_values(arm, c)),
        sigma(arm_covariance(arm, c)),
        bound(arm, x, sigma, c.level.ripple_rad, c.discrepancy.sigma_m) {}
};

Predictor::Predictor(const Calibration& calibration)
    : impl_(std::make_unique<Impl>(calibration, at_level(calibration.cell, calibration.level))) {}
Predictor::~Predictor() = default;
Predictor::Predictor(Predictor&&) noexcept = default;

Prediction Predictor::calibrated(std::span<const double> joint_rad) const {
  const PreparedPose pose = impl_->arm.prepare(joint_rad);
  Prediction result;
  result.tcp = impl_->arm.shape(pose, impl_->x.data()).tcp;
  Eigen::Matrix3Xd jacobian(3, impl_->arm.size());
  const Eigen::Vector3d tip = impl_->arm.position(pose, impl_->x.data(), jacobian);
  result.u95_m = impl_->bound.u95_m(joint_rad, tip, jacobian);
  return result;
}

double Predictor::mean_error_m(const std::vector<JointVector>& poses) const {
  if (impl_->sigma.size() == 0) return 0.0;
  const Eigen::VectorXd si = Eigen::VectorXd::Ones(impl_->arm.size());
  return predicted_mean_error_m(aligned_moves(impl_->arm, poses, impl_->x.data(), si), impl_->sigma,
                                Eigen::VectorXd::Zero(static_cast<Eigen::Index>(poses.size())));
}

Eigen::Isometry3d Predictor::nominal(std::span<const double> joint_rad) const {
  return impl_->arm.nominal_tcp(joint_rad);
}

}  // namespace cellcal::calib
