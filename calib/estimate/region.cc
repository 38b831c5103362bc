#include "calib/estimate/region.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "calib/model/linear.h"
#include "calib/model/product.h"

namespace cellcal::calib {

std::vector<JointVector> workspace_poses(const ArmModel& arm, int count, unsigned seed) {
  constexpr double kFloorM = 0.05;
  constexpr double kFirstRad = 1.05, kWristRad = 2.97;
  constexpr double kMiddle = 0.75;
  const Eigen::Isometry3d to_foot = arm.robot().base_fixed.inverse();
  Random random(seed);
  std::vector<JointVector> poses, below;
  for (int attempt = 0; attempt < 100 * count && static_cast<int>(poses.size()) < count;
       ++attempt) {
    JointVector q;
    for (const Joint& joint : arm.robot().joints) {
      if (joint.is_prismatic()) {  // the whole track
        q.push_back(random.uniform(joint.min_rad, joint.max_rad));
        continue;
      }
      const bool learnt = joint.function_min_rad < joint.function_max_rad;
      const double least = learnt ? joint.function_min_rad : joint.min_rad,
                   most = learnt ? joint.function_max_rad : joint.max_rad;
      const double middle = (least + most) / 2.0;
      double half = kMiddle * (most - least) / 2.0;
      if (q.size() == arm.robot().first_turning()) half = std::min(half, kFirstRad);
      const double low = learnt ? middle - half : std::max(middle - half, -kWristRad),
                   high = learnt ? middle + half : std::min(middle + half, kWristRad);
      q.push_back(low < high ? random.uniform(low, high) : middle);
    }
    const bool above = (to_foot * arm.nominal_tip_m(q)).z() > kFloorM;
    if (above || static_cast<int>(below.size()) < count)
      (above ? poses : below).push_back(std::move(q));
  }
  // An arm that hardly reaches above its foot works below it.
  for (std::size_t k = 0; k < below.size() && static_cast<int>(poses.size()) < count; ++k)
    poses.push_back(std::move(below[k]));
  return poses;
}

std::vector<JointVector> local_poses(const ArmModel& arm, const std::vector<JointVector>& around,
                                     const std::vector<Eigen::Vector3d>& centres_m, int count,
                                     unsigned seed) {
  constexpr double kSpreadRad = 0.3, kSpreadM = 0.1;
  Random random(seed);
  std::vector<JointVector> poses;
  if (around.empty()) return poses;
  for (int attempt = 0; attempt < 50 * count && static_cast<int>(poses.size()) < count; ++attempt) {
    JointVector q = around[random.below(around.size())];
    for (std::size_t i = 0; i < q.size(); ++i) {
      const Joint& joint = arm.robot().joints[i];
      const double spread = joint.is_prismatic() ? kSpreadM : kSpreadRad;
      q[i] = std::clamp(q[i] + random.uniform(-spread, spread), joint.min_rad, joint.max_rad);
    }
    const Eigen::Vector3d tip = arm.nominal_tip_m(q);
    for (const Eigen::Vector3d& centre : centres_m) {
      if ((tip - centre).cwiseAbs().maxCoeff() > kNearTargetM) continue;
      poses.push_back(std::move(q));
      break;
    }
  }
  return poses;
}

std::vector<JointVector> tracker_region(const Cell& cell, std::span<const Touch> touches,
                                        const std::vector<bool>& use) {
  constexpr std::size_t kMost = 60;
  std::vector<JointVector> all;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const Touch& touch = touches[i];
    if (touch.set != TouchSet::kFit || (!use.empty() && !use[i])) continue;
    const auto target = std::ranges::find(cell.targets, touch.target, &Target::id);
    if (target == cell.targets.end() || target->kind != TargetKind::kTracker ||
        target->carried_by != 0)
      return {};
    all.push_back(touch.joint_rad);
  }
  if (all.size() <= kMost) return all;
  std::vector<JointVector> some;
  for (std::size_t k = 0; k < kMost; ++k) some.push_back(std::move(all[k * all.size() / kMost]));
  return some;
}

std::vector<JointVector> poses_between(const std::vector<JointVector>& postures, int count,
                                       unsigned seed) {
  std::vector<JointVector> poses;
  if (postures.empty()) return poses;
  Random random(seed);
  while (static_cast<int>(poses.size()) < count) {
    const JointVector& from = postures[random.below(postures.size())];
    const JointVector& to = postures[random.below(postures.size())];
    poses.push_back(interpolated(from, to, random.uniform()));
  }
  return poses;
}

Eigen::Matrix<double, 3, 6> base_motion(const Eigen::Vector3d& p) {
  Eigen::Matrix<double, 3, 6> motion;
  motion.leftCols<3>().setIdentity();
  motion.rightCols<3>() << 0, p.z(), -p.y(), -p.z(), 0, p.x(), p.y(), -p.x(), 0;
  return motion;
}

Eigen::Matrix<double, Eigen::Dynamic, 6> base_motions(const Eigen::Matrix3Xd& points_m) {
  Eigen::Matrix<double, Eigen::Dynamic, 6> motions(3 * points_m.cols(), 6);
  for (Eigen::Index k = 0; k < points_m.cols(); ++k)
    motions.middleRows<3>(3 * k) = base_motion(points_m.col(k));
  return motions;
}

TipMoves tip_moves(const ArmModel& arm, std::size_t count,
                   const std::function<PreparedPose(std::size_t)>& pose, const double* x_si,
                   const Eigen::VectorXd& scale) {
  const int n = arm.size();
  TipMoves at{Eigen::Matrix3Xd(3, count), Eigen::MatrixXd(3 * count, n)};
  Eigen::Matrix3Xd jacobian(3, n);
  const ArmErrors errors = arm.errors(x_si);
  ArmChain chain;
  for (std::size_t i = 0; i < count; ++i) {
    const PreparedPose prepared = pose(i);
    arm.walk(prepared, errors, chain);
    arm.derivative(prepared, errors, chain, jacobian);
    const auto k = static_cast<Eigen::Index>(i);
    at.tips_m.col(k) = chain.tip;
    at.moves_m.middleRows<3>(3 * k) = jacobian;
  }
  if (scale.size() > 0) at.moves_m *= scale.head(n).asDiagonal();
  return at;
}

TipMoves tip_moves(const ArmModel& arm, std::span<const JointVector> poses, const double* x_si,
                   const Eigen::VectorXd& scale) {
  return tip_moves(
      arm, poses.size(), [&](std::size_t k) { return arm.prepare(poses[k]); }, x_si, scale);
}

namespace {

/// Moves, three rows per tip, after removal of the part that a base motion absorbs.
Eigen::MatrixXd without_base_motion(const Eigen::Matrix3Xd& all_tips_m,
                                    const Eigen::MatrixXd& moves_m) {
  // Base motion about the mean of the tips: the same motions, and well conditioned.
  const auto rigid = base_motions(all_tips_m.colwise() - all_tips_m.rowwise().mean().eval());
  const Eigen::Matrix<double, 6, 6> square = rigid.transpose() * rigid;
  const Eigen::Matrix<double, 6, Eigen::Dynamic> pulled = rigid.transpose() * moves_m;
  return moves_m - rigid * square.completeOrthogonalDecomposition().solve(pulled);
}

constexpr int kDrawnArms = 400;  // for a relative error of the spread of 4 %
constexpr unsigned kDrawSeed = 41;

double variance(const Eigen::VectorXd& values) {
  return (values.array() - values.mean()).square().sum() / static_cast<double>(values.size() - 1);
}

}  // namespace

Eigen::MatrixXd aligned(const TipMoves& at) { return without_base_motion(at.tips_m, at.moves_m); }

Eigen::MatrixXd aligned_moves(const ArmModel& arm, const std::vector<JointVector>& poses,
                              const double* x_si, const Eigen::VectorXd& scale) {
  return aligned(tip_moves(arm, poses, x_si, scale));
}

Eigen::Matrix3Xd apart(const ArmModel& arm, const std::vector<JointVector>& poses,
                       const double* one_si, const double* other_si) {
  const auto count = static_cast<Eigen::Index>(poses.size());
  Eigen::Matrix3Xd tips_m(3, count), off_m(3, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const PreparedPose pose = arm.prepare(poses[static_cast<std::size_t>(k)]);
    tips_m.col(k) = arm.position(pose, one_si);
    off_m.col(k) = arm.position(pose, other_si) - tips_m.col(k);
  }
  return without_base_motion(tips_m, off_m.reshaped()).reshaped(3, count);
}

Eigen::VectorXd ripple_variance_m2(const ArmModel& arm, const std::vector<JointVector>& poses,
                                   double ripple_rad) {
  Eigen::VectorXd variance = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(poses.size()));
  if (!(ripple_rad > 0.0)) return variance;
  const auto turning =
      static_cast<Eigen::Index>(arm.robot().joints.size() - arm.robot().first_turning());
  for (Eigen::Index k = 0; k < variance.size(); ++k)
    variance[k] = arm.nominal_jacobian(poses[static_cast<std::size_t>(k)])
                      .topRows<3>()
                      .rightCols(turning)
                      .squaredNorm() *
                  ripple_rad * ripple_rad;
  return variance;
}

double predicted_mean_error_m(const Eigen::MatrixXd& moves, const Eigen::MatrixXd& covariance_u,
                              const Eigen::VectorXd& stays_m2) {
  const Eigen::Index count = moves.rows() / 3;
  if (count == 0) return 0.0;
  // Variance of each coordinate, three per tip.
  const Eigen::MatrixXd through = product(moves, covariance_u);
  Eigen::VectorXd variance = Eigen::VectorXd::Zero(moves.rows());
  for (Eigen::Index c = 0; c < moves.cols(); ++c)
    variance += through.col(c).cwiseProduct(moves.col(c));
  double sum = 0.0;
  for (Eigen::Index k = 0; k < count; ++k)
    sum += std::sqrt(std::max(0.0, variance.segment<3>(3 * k).sum()) + stays_m2[k]);
  return kMeanOverRms * sum / static_cast<double>(count);  // (40)
}

Eigen::MatrixXd drawn_arms(const Eigen::MatrixXd& covariance) {
  const Eigenpairs pairs = eigenpairs(covariance);
  Eigen::MatrixXd all(covariance.rows(), kDrawnArms);
  Random random(kDrawSeed);
  for (double& one : all.reshaped()) one = random.normal();
  // The symmetric root: others depend on the eigenvectors' signs, which the last digit decides.
  const Eigen::MatrixXd roots = pairs.vectors * pairs.values.cwiseMax(0.0).cwiseSqrt().asDiagonal();
  return product(roots, product(pairs.vectors.transpose(), all));
}

NominalError nominal_error(const ArmModel& arm, const std::vector<JointVector>& poses,
                           const double* x_si, const Eigen::MatrixXd& moves,
                           const Eigen::MatrixXd& arms, const Eigen::VectorXd& stays_m2) {
  Eigen::MatrixXd apart_m = product(moves, arms);
  apart_m.colwise() += apart(arm, poses, x_si, nullptr).reshaped();
  const auto count = static_cast<Eigen::Index>(poses.size());
  Eigen::MatrixXd off_m(count, arms.cols());
  for (Eigen::Index k = 0; k < arms.cols(); ++k)
    for (Eigen::Index i = 0; i < count; ++i)
      off_m(i, k) = std::sqrt(apart_m.col(k).segment<3>(3 * i).squaredNorm() +
                              kMeanOverRms * kMeanOverRms * stays_m2[i]);
  const double of_arms_m2 = variance(off_m.colwise().mean());
  const double of_poses_m2 = variance(off_m.rowwise().mean()) / static_cast<double>(count);
  return {off_m.mean(), 2.0 * std::sqrt(of_arms_m2 + of_poses_m2)};
}

}  // namespace cellcal::calib
