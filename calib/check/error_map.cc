#include "calib/check/error_map.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "calib/estimate/region.h"
#include "calib/model/kinematics.h"

namespace cellcal::calib {

namespace {

constexpr int kMapPoses = 3000;
constexpr unsigned kMapSeed = 20261128;
constexpr int kSquaresAcross = 16;
constexpr Eigen::Index kLeastMapPoses = 100;

/// Mean of the norm of a 3-D Gaussian with this mean and total variance, about.
double mean_norm_m(double mean_m, double variance_m2) {
  return std::sqrt(mean_m * mean_m + kMeanOverRms * kMeanOverRms * variance_m2);
}

struct PoseErrors {
  Eigen::Matrix3Xd tips_m;  ///< from the arm's foot
  Eigen::VectorXd nominal_m, calibrated_m;
};

PoseErrors errors_at(const Calibration& c, const ArmModel& arm,
                     const std::vector<JointVector>& poses) {
  const Eigen::VectorXd x = arm_values(arm, c), none = Eigen::VectorXd::Zero(arm.size());
  const TipMoves at = tip_moves(arm, poses, x.data());
  const Eigen::MatrixXd moves = aligned(at);
  const Eigen::MatrixXd spread = moves * arm_covariance(arm, c);
  const Eigen::VectorXd ripple = ripple_variance_m2(arm, poses, c.level.ripple_rad);
  const double field = 3.0 * c.discrepancy.sigma_m * c.discrepancy.sigma_m;
  const Eigen::Matrix3Xd off = apart(arm, poses, none.data(), x.data());
  const Eigen::Isometry3d to_foot = arm.robot().base_fixed.inverse();
  PoseErrors errors{to_foot * at.tips_m, Eigen::VectorXd(off.cols()), Eigen::VectorXd(off.cols())};
  for (Eigen::Index k = 0; k < off.cols(); ++k) {
    const double variance =
        spread.middleRows<3>(3 * k).cwiseProduct(moves.middleRows<3>(3 * k)).sum();
    const double whole = std::max(0.0, variance) + ripple[k] + field;
    errors.nominal_m[k] = mean_norm_m(off.col(k).norm(), whole);
    errors.calibrated_m[k] = mean_norm_m(0.0, whole);
  }
  return errors;
}

}  // namespace

std::optional<ErrorMap> error_map(const Calibration& c) {
  if (c.covariance.size() == 0 || c.cell.robot.first_turning() > 0) return std::nullopt;
  const ArmModel arm(at_level(c.cell, c.level));
  const auto poses = workspace_poses(arm, kMapPoses, kMapSeed);
  if (static_cast<Eigen::Index>(poses.size()) < kLeastMapPoses) return std::nullopt;
  const PoseErrors errors = errors_at(c, arm, poses);
  const Eigen::VectorXd r = errors.tips_m.topRows<2>().colwise().norm();
  ErrorMap map;
  map.step_m = r.maxCoeff() / kSquaresAcross;
  if (!(map.step_m > 0.0)) return std::nullopt;
  std::map<std::pair<int, int>, ErrorCell> cells;
  for (Eigen::Index k = 0; k < r.size(); ++k) {
    const int across = static_cast<int>(std::floor(r[k] / map.step_m)),
              up = static_cast<int>(std::floor(errors.tips_m(2, k) / map.step_m));
    ErrorCell& cell = cells[{up, across}];
    cell.r_m = (across + 0.5) * map.step_m;
    cell.z_m = (up + 0.5) * map.step_m;
    ++cell.poses;
    cell.nominal_m += errors.nominal_m[k];
    cell.calibrated_m += errors.calibrated_m[k];
  }
  for (auto& [at, cell] : cells) {
    if (cell.poses < kLeastPosesOfCell) continue;
    cell.nominal_m /= cell.poses;
    cell.calibrated_m /= cell.poses;
    map.cells.push_back(cell);
  }
  return map;
}

}  // namespace cellcal::calib
