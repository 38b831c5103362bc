#include "calib/identify/bound.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "calib/identify/region.h"
#include "calib/model/random.h"

namespace cellcal::calib {

namespace {

constexpr int kPoses = 200;
constexpr unsigned kRegionSeed = 20240924;
constexpr int kArms = 400;  ///< drawn from the covariance
constexpr double kShare = 0.95, kConfidence = 0.98;

/// Radius that holds 95 % of a 3-D Gaussian with covariance c: the weighted sum of squares is
/// matched to a scaled chi^2 (Satterthwaite), its quantile taken by Wilson and Hilferty.
double radius_95(const Eigen::Matrix3d& c) {
  const double mean = c.trace();
  if (!(mean > 0.0)) return 0.0;
  const double variance = 2.0 * (c * c).trace();
  const double dof = 2.0 * mean * mean / variance;
  constexpr double kNormal95 = 1.6448536269514722;
  const double t = 2.0 / (9.0 * dof);
  return std::sqrt(mean * std::pow(1.0 - t + kNormal95 * std::sqrt(t), 3));
}

double quantile(std::vector<double>& values, double share) {
  const auto k = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + k, values.end());
  return values[static_cast<std::size_t>(k)];
}

/// A root F with F F' = covariance, which may be singular and of mixed units. The symmetric one of
/// the correlations: a hair's change of the covariance changes it by a hair, so that what is drawn
/// with it can be drawn again after the numbers went through a file.
Eigen::MatrixXd root_of(const Eigen::MatrixXd& covariance) {
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Eigen::VectorXd inverse = (sigma.array() > 0.0).select(sigma.cwiseInverse(), 0.0);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(inverse.asDiagonal() * covariance *
                                                              inverse.asDiagonal());
  const Eigen::VectorXd roots = solver.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  return sigma.asDiagonal() *
         (solver.eigenvectors() * roots.asDiagonal() * solver.eigenvectors().transpose());
}

}  // namespace

PositionBound::PositionBound(const ArmModel& arm, const Eigen::VectorXd& x,
                             Eigen::MatrixXd covariance, double ripple_rad)
    : arm_(arm), x_(x), covariance_(std::move(covariance)), ripple_rad_(ripple_rad) {
  const auto poses = workspace_poses(arm, kPoses, kRegionSeed);
  const auto count = static_cast<Eigen::Index>(poses.size());
  constexpr Eigen::Index kEnough = 3;  // points that hold a rigid body
  taken_up_ = Eigen::MatrixXd::Zero(6, arm.size());
  if (count < kEnough || covariance_.size() == 0) return;
  Eigen::MatrixXd moves(3 * count, arm.size()), rigid(3 * count, 6);
  Eigen::Matrix3Xd jacobian(3, arm.size());
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Vector3d tip =
        arm.position(arm.prepare(poses[static_cast<std::size_t>(k)]), x.data(), jacobian);
    moves.middleRows<3>(3 * k) = jacobian;
    rigid.middleRows<3>(3 * k) = base_motion(tip);
  }
  taken_up_ = rigid.colPivHouseholderQr().solve(moves);
  moves -= rigid * taken_up_;

  const Eigen::MatrixXd spread = moves * root_of(covariance_);
  std::vector<Eigen::Index> seen;  // poses that the covariance moves at all
  std::vector<double> radius;
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto rows = spread.middleRows<3>(3 * k);
    const double r = radius_95(rows * rows.transpose());
    if (!(r > 0.0)) continue;
    seen.push_back(k);
    radius.push_back(r);
  }
  if (seen.empty()) return;
  Random random(kRegionSeed);
  Eigen::MatrixXd draw(spread.cols(), kArms);
  for (double& value : draw.reshaped()) value = random.normal();
  const Eigen::MatrixXd error = spread * draw;
  std::vector<double> needed, ratio(seen.size());
  for (Eigen::Index arm_drawn = 0; arm_drawn < kArms; ++arm_drawn) {
    for (std::size_t i = 0; i < seen.size(); ++i)
      ratio[i] = error.col(arm_drawn).segment<3>(3 * seen[i]).norm() / radius[i];
    needed.push_back(quantile(ratio, kShare));
  }
  widening_ = std::max(1.0, quantile(needed, kConfidence));
}

double PositionBound::u95_m(std::span<const double> joint_rad, const Eigen::Vector3d& tip,
                            const Eigen::Matrix3Xd& jacobian) const {
  if (covariance_.size() == 0) return 0.0;
  const Eigen::Matrix3Xd j = jacobian - base_motion(tip) * taken_up_;
  Eigen::Matrix3d c = j * covariance_ * j.transpose();
  if (ripple_rad_ > 0.0) {  // stays at every pose, however many touches there were
    const Eigen::Matrix3Xd by_joint = arm_.nominal_jacobian(joint_rad).topRows<3>();
    c += ripple_rad_ * ripple_rad_ * by_joint * by_joint.transpose();
  }
  return widening_ * radius_95(c);
}

double PositionBound::mean_u95_m(std::span<const JointVector> postures) const {
  Eigen::Matrix3Xd jacobian(3, arm_.size());
  const ArmErrors errors = arm_.errors(x_.data());
  ArmChain chain;
  double sum = 0.0;
  for (const JointVector& q : postures) {
    const PreparedPose pose = arm_.prepare(q);
    arm_.walk(pose, errors, chain);
    arm_.derivative(pose, errors, chain, jacobian);
    sum += u95_m(q, chain.tip, jacobian);
  }
  return postures.empty() ? 0.0 : sum / static_cast<double>(postures.size());
}

}  // namespace cellcal::calib
