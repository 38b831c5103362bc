#include "calib/estimate/predict.h"

#include <algorithm>
#include <cmath>

#include "calib/estimate/region.h"
#include "calib/model/error.h"
#include "calib/model/linear.h"

namespace cellcal::calib {

namespace {

constexpr int kPoses = 200;

constexpr int kArms = 400;  ///< drawn from the covariance
constexpr double kShare = 0.95, kConfidence = 0.98;
double quantile(std::vector<double>& values, double share) {
  const auto k = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + k, values.end());
  return values[static_cast<std::size_t>(k)];
}

/// Root F with F F' = covariance, which may be singular and of mixed units. The symmetric root of
/// the correlations depends continuously on the covariance, so that draws are reproducible after
/// the numbers have been written to a file and read again.
Eigen::MatrixXd root_of(const Eigen::MatrixXd& covariance) {
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Eigen::VectorXd inverse = (sigma.array() > 0.0).select(sigma.cwiseInverse(), 0.0);
  const Eigenpairs pairs = eigenpairs(inverse.asDiagonal() * covariance * inverse.asDiagonal());
  const Eigen::VectorXd roots = pairs.values.cwiseMax(0.0).cwiseSqrt();
  return sigma.asDiagonal() * (pairs.vectors * roots.asDiagonal() * pairs.vectors.transpose());
}

/// Region where a user may measure the base, and the base motion that absorbs each parameter there.
struct Region {
  std::vector<Eigen::Index> poses;
  Eigen::MatrixXd taken_up;  ///< 6 x parameters
};

/// All poses, and, where the base is measured in any of them, the lower and the upper half of them by
/// each row: coordinates of the tips, angles of a positioner.
std::vector<Region> regions_of(const Eigen::MatrixXd& by, bool halves) {
  std::vector<Region> regions(1);
  for (Eigen::Index k = 0; k < by.cols(); ++k) regions[0].poses.push_back(k);
  if (!halves) return regions;
  for (Eigen::Index row = 0; row < by.rows(); ++row) {
    std::vector<Eigen::Index> order = regions[0].poses;
    std::sort(order.begin(), order.end(),
              [&](Eigen::Index a, Eigen::Index b) { return by(row, a) < by(row, b); });
    const auto middle = order.begin() + static_cast<std::ptrdiff_t>(order.size() / 2);
    regions.push_back({{order.begin(), middle}, {}});
    regions.push_back({{middle, order.end()}, {}});
  }
  return regions;
}

/// The three rows of each of `poses`.
Eigen::MatrixXd rows_of(const Eigen::MatrixXd& all, const std::vector<Eigen::Index>& poses) {
  Eigen::MatrixXd rows(3 * static_cast<Eigen::Index>(poses.size()), all.cols());
  Eigen::Index row = 0;
  for (const Eigen::Index k : poses) {
    rows.middleRows<3>(row) = all.middleRows<3>(3 * k);
    row += 3;
  }
  return rows;
}

/// Rows of the fit at postures of their own: those of repeats, and of turns, hold the same ripple.
double rows_of_postures(const Calibration& c) {
  const double postures = c.after.count - c.repeats.degrees_of_freedom;
  return std::min(c.degrees_of_freedom, (c.region.empty() ? 1.0 : 3.0) * postures);
}

}  // namespace

struct Predictor::Impl {
  ArmModel arm;
  Eigen::VectorXd x;
  Eigen::MatrixXd sigma;  ///< covariance of the arm's parameters, SI
  PositionBound bound;

  Impl(const Calibration& c, const Cell& levelled, int carriers)
      : arm(levelled),
        x(arm_values(arm, c)),
        sigma(arm_covariance(arm, c)),
        bound(carriers == 0 ? PositionBound(arm, x, sigma, ripple_elsewhere_rad(c),
                                            c.discrepancy.sigma_m, c.region)
                            : PositionBound(arm, x, sigma, ripple_elsewhere_rad(c),
                                            c.discrepancy.sigma_m, work_on(c, carriers))) {}

  std::vector<CarriedPose> work_on(const Calibration& c, int carriers) const {
    auto poses = carried_poses(arm, c, carriers, kPoses, kRegionSeed);
    if (poses.empty())
      throw PositionerError(
          "no touched target stands on " +
          c.cell.robot.positioner.at(static_cast<std::size_t>(carriers) - 1).name +
          " within the arm's reach: its place is as drawn. Calibrate with "
          "spheres on it");
    return poses;
  }
};

Predictor::Predictor(const Calibration& calibration, int carriers)
    : impl_(make_hidden<Impl>(calibration, at_level(calibration.cell, calibration.level),
                              carriers)) {}

Prediction Predictor::calibrated(std::span<const double> joint_rad,
                                 std::span<const double> carrier_rad,
                                 std::span<const double> outer_rad) const {
  const PreparedPose pose = impl_->arm.prepare(joint_rad, 0, nullptr, carrier_rad, outer_rad);
  Prediction result;
  result.tcp = impl_->arm.shape(pose, impl_->x.data()).tcp;
  Eigen::Matrix3Xd jacobian(3, impl_->arm.size());
  const Eigen::Vector3d tip = impl_->arm.position(pose, impl_->x.data(), jacobian);
  result.u95_m = impl_->bound.u95_m(joint_rad, tip, jacobian, carrier_rad);
  return result;
}

double Predictor::mean_error_m(const std::vector<JointVector>& poses) const {
  if (impl_->sigma.size() == 0) return 0.0;
  return predicted_mean_error_m(aligned_moves(impl_->arm, poses, impl_->x.data()), impl_->sigma,
                                Eigen::VectorXd::Zero(static_cast<Eigen::Index>(poses.size())));
}

Eigen::Isometry3d Predictor::nominal(std::span<const double> joint_rad,
                                     std::span<const double> carrier_rad) const {
  return impl_->arm.nominal_tcp(joint_rad, 0, carrier_rad);
}

Scope::Scope(const Calibration& calibration) : workspace_(calibration.verdict.workspace) {
  const ArmModel arm(calibration.cell);
  for (const JointVector& q : calibration.region) near_.push_back({arm.nominal_tip_m(q), 0});
  if (!calibration.region.empty()) return;
  for (const TargetResult& target : calibration.targets) {
    const auto stated = std::ranges::find(calibration.cell.targets, target.id, &Target::id);
    near_.push_back(
        {target.centre_m, stated == calibration.cell.targets.end() ? 0 : stated->carried_by});
  }
}

bool Scope::holds_at(const Eigen::Vector3d& tcp_m, int carriers) const {
  return workspace_ || std::ranges::any_of(near_, [&](const Place& place) {
           return place.carriers == carriers &&
                  (tcp_m - place.place_m).cwiseAbs().maxCoeff() <= kNearTargetM;
         });
}

double ripple_elsewhere_rad(double ripple_rad, double rows) {
  constexpr double kFew = 300.0;
  const double common = rows > kFew ? kFew / rows : 1.0;
  return std::sqrt(1.0 + common) * ripple_rad;  // (37)
}

double ripple_elsewhere_rad(const Calibration& c) {
  return ripple_elsewhere_rad(c.level.ripple_rad, rows_of_postures(c));
}

double radius_95(const Eigen::Matrix3d& c) {
  const double mean = c.trace();
  if (!(mean > 0.0)) return 0.0;
  const double variance = 2.0 * (c * c).trace();
  const double dof = 2.0 * mean * mean / variance;  // (38)
  constexpr double kNormal95 = 1.6448536269514722;
  const double t = 2.0 / (9.0 * dof);
  return std::sqrt(mean * std::pow(1.0 - t + kNormal95 * std::sqrt(t), 3));
}

PositionBound::PositionBound(const ArmModel& arm, const Eigen::VectorXd& x,
                             Eigen::MatrixXd covariance, double ripple_rad, double field_m,
                             const std::vector<JointVector>& measured)
    : PositionBound(arm, x, std::move(covariance), ripple_rad, field_m,
                    std::vector<CarriedPose>{}) {
  const auto poses = measured.empty() ? workspace_poses(arm, kPoses, kRegionSeed)
                                      : poses_between(measured, kPoses, kRegionSeed);
  std::vector<CarriedPose> in_base;
  for (const JointVector& q : poses) in_base.push_back({q, {}});
  spread_over(in_base, measured.empty());
}

PositionBound::PositionBound(const ArmModel& arm, const Eigen::VectorXd& x,
                             Eigen::MatrixXd covariance, double ripple_rad, double field_m,
                             const std::vector<CarriedPose>& on_positioner)
    : arm_(arm),
      x_(x),
      covariance_(std::move(covariance)),
      ripple_rad_(ripple_rad),
      field_m_(field_m) {
  taken_up_ = Eigen::MatrixXd::Zero(6, arm.size());
  spread_over(on_positioner, true);
}

void PositionBound::spread_over(const std::vector<CarriedPose>& poses, bool halves) {
  const auto count = static_cast<Eigen::Index>(poses.size());
  constexpr Eigen::Index kEnough = 6;  // each half has three points, which fix a rigid body
  if (count < kEnough || covariance_.size() == 0) return;
  const auto carriers = static_cast<Eigen::Index>(poses.front().carrier_rad.size());
  const auto [tips, moves] = tip_moves(arm_, poses, x_.data());
  const Eigen::MatrixXd rigid = base_motions(tips);
  Eigen::MatrixXd places(3 + carriers, count);
  for (Eigen::Index k = 0; k < count; ++k)
    places.col(k) << tips.col(k),
        Eigen::VectorXd::Map(poses[static_cast<std::size_t>(k)].carrier_rad.data(), carriers);
  const Eigen::MatrixXd root = root_of(covariance_);
  const Eigen::MatrixXd spread = moves * root;
  std::vector<Region> regions = regions_of(places, halves);
  for (Region& region : regions) {
    const Eigen::MatrixXd its_rigid = rows_of(rigid, region.poses);
    region.taken_up = least_squares(its_rigid, rows_of(moves, region.poses));
    taken_up_ += region.taken_up / static_cast<double>(regions.size());  // (36), A_m
  }
  for (const Region& region : regions) {
    const Eigen::MatrixXd off = (region.taken_up - taken_up_) * root;
    base_covariance_ += off * off.transpose() / static_cast<double>(regions.size());  // (36), K_B
  }

  std::vector<double> radius;
  const Eigen::MatrixXd aligned = spread - rigid * (taken_up_ * root);
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto rows = aligned.middleRows<3>(3 * k);
    const auto base = rigid.middleRows<3>(3 * k);
    radius.push_back(
        radius_95(rows * rows.transpose() + base * base_covariance_ * base.transpose()));
  }
  Random random(kRegionSeed);
  Eigen::MatrixXd draw(spread.cols(), kArms);
  for (double& value : draw.reshaped()) value = random.normal();
  const Eigen::MatrixXd error = spread * draw;
  std::vector<double> needed, ratio;
  for (Eigen::Index arm_drawn = 0; arm_drawn < kArms; ++arm_drawn) {
    const Region& region = regions[static_cast<std::size_t>(arm_drawn) % regions.size()];
    const Eigen::VectorXd base = region.taken_up * (root * draw.col(arm_drawn));
    ratio.clear();
    for (const Eigen::Index k : region.poses) {
      const double r = radius[static_cast<std::size_t>(k)];
      if (!(r > 0.0)) continue;  // unaffected by the covariance
      const Eigen::Vector3d off =
          error.col(arm_drawn).segment<3>(3 * k) - rigid.middleRows<3>(3 * k) * base;
      ratio.push_back(off.norm() / r);
    }
    if (ratio.empty()) return;
    needed.push_back(quantile(ratio, kShare));
  }
  widening_ = std::max(1.0, quantile(needed, kConfidence));  // (39)
}

Eigen::Matrix3d PositionBound::covariance(const Eigen::Matrix3Xd& jacobian,
                                          const Eigen::Matrix<double, 3, 6>& base) const {
  const Eigen::Matrix3Xd j = jacobian - base * taken_up_;
  return j * covariance_ * j.transpose() + base * base_covariance_ * base.transpose();
}

double PositionBound::u95_m(std::span<const double> joint_rad, const Eigen::Vector3d& tip,
                            const Eigen::Matrix3Xd& jacobian,
                            std::span<const double> carrier_rad) const {
  if (covariance_.size() == 0) return 0.0;
  Eigen::Matrix3d c = covariance(jacobian, base_motion(tip));
  if (ripple_rad_ > 0.0) {  // remains at every pose for any number of touches
    Eigen::Matrix3Xd by_joint = arm_.nominal_jacobian(joint_rad).topRows<3>();
    by_joint.leftCols(static_cast<Eigen::Index>(arm_.robot().first_turning())).setZero();
    if (!carrier_rad.empty())
      by_joint = carried_at(arm_.robot(), carrier_rad).linear().transpose() * by_joint;
    c += ripple_rad_ * ripple_rad_ * by_joint * by_joint.transpose();
  }
  c.diagonal().array() += field_m_ * field_m_;  // as far from all touches
  return widening_ * radius_95(c);
}

double PositionBound::mean_u95_m(std::span<const JointVector> postures) const {
  const TipMoves at = tip_moves(arm_, postures, x_.data());
  double sum = 0.0;
  for (std::size_t i = 0; i < postures.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    sum += u95_m(postures[i], at.tips_m.col(k), at.moves_m.middleRows<3>(3 * k));
  }
  return postures.empty() ? 0.0 : sum / static_cast<double>(postures.size());
}

}  // namespace cellcal::calib
