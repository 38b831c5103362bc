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

}  // namespace

NominalError nominal_error(const ArmModel& arm, const std::vector<JointVector>& poses,
                           const double* x_si, const Eigen::MatrixXd& moves,
                           const Eigen::MatrixXd& covariance, const Eigen::VectorXd& stays_m2) {
  Eigen::MatrixXd apart_m = moves * deviations(covariance);
  apart_m.colwise() += apart(arm, poses, x_si, nullptr).reshaped();
  const auto count = static_cast<Eigen::Index>(poses.size());
  Eigen::VectorXd means_m(kDrawnArms);
  for (Eigen::Index k = 0; k < kDrawnArms; ++k) {
    double sum = 0.0;
    for (Eigen::Index i = 0; i < count; ++i)
      sum += std::sqrt(apart_m.col(k).segment<3>(3 * i).squaredNorm() +
                       kMeanOverRms * kMeanOverRms * stays_m2[i]);
    means_m[k] = sum / static_cast<double>(count);
  }
  const double mean_m = means_m.mean();
  return {mean_m, 2.0 * std::sqrt((means_m.array() - mean_m).square().sum() / (kDrawnArms - 1))};
}

}  // namespace cellcal::calib
