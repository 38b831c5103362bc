#include "calib/identify/predict.h"

#include <cmath>
#include <map>

#include "calib/identify/frame.h"
#include "calib/model/kinematics.h"

namespace cellcal::calib {

namespace {

/// Radius that holds 95 % of a 3-D Gaussian with covariance c: the weighted sum of squares is
/// matched to a scaled chi^2 (Satterthwaite), its quantile taken by Wilson and Hilferty.
double radius_95(const Eigen::Matrix3d& c) {
  const double mean = c.trace();
  if (mean <= 0.0) return 0.0;
  const double variance = 2.0 * (c * c).trace();
  const double dof = 2.0 * mean * mean / variance;
  constexpr double kNormal95 = 1.6448536269514722;
  const double t = 2.0 / (9.0 * dof);
  return std::sqrt(mean * std::pow(1.0 - t + kNormal95 * std::sqrt(t), 3));
}

}  // namespace

struct Predictor::Impl {
  ArmModel arm;
  Eigen::VectorXd x;
  Eigen::MatrixXd covariance;  // arm parameters, SI, frame directions aside

  double ripple_rad = 0.0;

  Impl(const Calibration& c, const Cell& levelled)
      : arm(levelled.robot, levelled.tool), ripple_rad(c.level.ripple_rad) {
    const int n = arm.size();
    std::map<std::string, Eigen::Index> index;
    for (std::size_t i = 0; i < c.parameters.size(); ++i)
      index[c.parameters[i].name] = static_cast<Eigen::Index>(i);
    const Eigen::MatrixXd all = without_frame(c.covariance, c.frame_basis);
    x = Eigen::VectorXd::Zero(n);
    covariance = Eigen::MatrixXd::Zero(n, n);
    std::vector<Eigen::Index> at(n, -1);
    for (int i = 0; i < n; ++i)
      if (const auto found = index.find(arm.parameters()[i].name); found != index.end())
        at[i] = found->second;
    for (int i = 0; i < n; ++i) {
      if (at[i] < 0) continue;
      const ParameterResult& p = c.parameters[static_cast<std::size_t>(at[i])];
      x[i] = p.nominal + p.correction;
      if (all.size() == 0) continue;
      for (int j = 0; j < n; ++j)
        if (at[j] >= 0) covariance(i, j) = all(at[i], at[j]);
    }
  }
};

Predictor::Predictor(const Calibration& calibration)
    : impl_(std::make_unique<Impl>(calibration, at_level(calibration.cell, calibration.level))) {}
Predictor::~Predictor() = default;
Predictor::Predictor(Predictor&&) noexcept = default;

Prediction Predictor::calibrated(std::span<const double> joint_rad) const {
  const PreparedPose pose = impl_->arm.prepare(joint_rad);
  Prediction result;
  result.tcp = impl_->arm.shape(pose, impl_->x.data()).tcp;
  Eigen::Matrix3Xd j(3, impl_->arm.size());
  impl_->arm.position(pose, impl_->x.data(), j);
  Eigen::Matrix3d covariance = j * impl_->covariance * j.transpose();
  if (impl_->ripple_rad > 0.0) {  // stays at every pose, however many touches there were
    const Eigen::Matrix3Xd by_joint = impl_->arm.nominal_jacobian(joint_rad).topRows<3>();
    covariance += impl_->ripple_rad * impl_->ripple_rad * by_joint * by_joint.transpose();
  }
  result.u95_m = radius_95(covariance);
  return result;
}

Eigen::Isometry3d Predictor::nominal(std::span<const double> joint_rad) const {
  return impl_->arm.nominal_tcp(joint_rad);
}

}  // namespace cellcal::calib
