#include "calib/uncertainty/nominal_error.h"

#include <cmath>

#include "calib/linear/eigenpairs.h"
#include "calib/model/random.h"
#include "calib/uncertainty/region.h"

namespace cellcal::calib {

namespace {

constexpr int kDrawnArms = 400;  // the spread is then known to 4 %
constexpr unsigned kDrawSeed = 41;

/// Columns: deviations drawn from the covariance, which may be singular.
Eigen::MatrixXd deviations(const Eigen::MatrixXd& covariance) {
  const Eigenpairs pairs = eigenpairs(covariance);
  Eigen::MatrixXd all(covariance.rows(), kDrawnArms);
  Random random(kDrawSeed);
  for (double& one : all.reshaped()) one = random.normal();
  return pairs.vectors * pairs.values.cwiseMax(0.0).cwiseSqrt().asDiagonal() * all;
}

double variance(const Eigen::VectorXd& values) {
  return (values.array() - values.mean()).square().sum() / static_cast<double>(values.size() - 1);
}

}  // namespace

NominalError nominal_error(const ArmModel& arm, const std::vector<JointVector>& poses,
                           const double* x_si, const Eigen::MatrixXd& moves,
                           const Eigen::MatrixXd& covariance, const Eigen::VectorXd& stays_m2) {
  Eigen::MatrixXd apart_m = moves * deviations(covariance);
  apart_m.colwise() += apart(arm, poses, x_si, nullptr).reshaped();
  const auto count = static_cast<Eigen::Index>(poses.size());
  Eigen::MatrixXd off_m(count, kDrawnArms);
  for (Eigen::Index k = 0; k < kDrawnArms; ++k)
    for (Eigen::Index i = 0; i < count; ++i)
      off_m(i, k) = std::sqrt(apart_m.col(k).segment<3>(3 * i).squaredNorm() +
                              kMeanOverRms * kMeanOverRms * stays_m2[i]);
  const double of_arms_m2 = variance(off_m.colwise().mean());
  const double of_poses_m2 = variance(off_m.rowwise().mean()) / static_cast<double>(count);
  return {off_m.mean(), 2.0 * std::sqrt(of_arms_m2 + of_poses_m2)};
}

}  // namespace cellcal::calib
