#include "calib/plan/choose.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "calib/identify/level.h"
#include "calib/identify/problem.h"
#include "calib/identify/region.h"
#include "calib/identify/solve.h"

namespace cellcal::calib {

namespace {

constexpr int kPoses = 200;
constexpr unsigned kRegionSeed = 7;
/// Of the compliance that is assumed where the file states none: what most arms have.
constexpr double kUsualCompliance = 0.3;
/// Centres without a prior: a metre, in prior units, is no information.
constexpr double kNoPriorWeight = 1e-2;
/// Smallest eigenvalue of a sphere's sum of d d' over its touches, d the unit direction of a touch,
/// for its centre to be held from all sides (the verdict withholds results below a tenth of it).
constexpr double kSpread = 0.5;
/// The last touches owed to a sphere go where it is held worst.
constexpr int kForSpread = 2;

/// The directions in which a sphere was touched so far.
class Held {
 public:
  void add(const Eigen::Vector3d& direction) {
    sum_ += direction * direction.transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(sum_);
    least_ = solver.eigenvalues()[0];
    worst_ = solver.eigenvectors().col(0);
    ++count_;
  }
  int count() const { return count_; }
  /// Touches still to be made for a sphere that is to have `least`.
  int owed(int least) const {
    return count_ < least ? least - count_ : least > 0 && least_ < kSpread ? 1 : 0;
  }
  double in_worst(const Eigen::Vector3d& direction) const {
    return std::pow(worst_.dot(direction), 2);
  }

 private:
  Eigen::Matrix3d sum_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d worst_ = Eigen::Vector3d::UnitZ();
  double least_ = 0.0;
  int count_ = 0;
};

}  // namespace

Choice choose(const Cell& stated, const std::vector<Candidate>& candidates, int count,
              int least_per_target) {
  // With what the geometry lacks: touches are chosen for the arm as it will be judged.
  const bool gives =
      std::any_of(stated.robot.joints.begin(), stated.robot.joints.end(),
                  [](const Joint& joint) { return joint.compliance_sigma_rad_per_nm > 0.0; });
  const Cell cell = at_level(stated, {gives ? 1.0 : kUsualCompliance, 1.0, 0.0});
  const ArmModel arm(cell.robot, cell.tool);
  std::vector<Touch> touches;
  for (const Candidate& c : candidates) {
    Touch touch;
    touch.joint_rad = c.contact;
    touch.target = cell.targets[c.target].id;
    touches.push_back(std::move(touch));
  }
  std::vector<Eigen::Vector3d> centres;
  for (const Target& target : cell.targets) centres.push_back(target.centre_m);
  const Problem problem(cell, arm, touches, {centres.begin(), centres.end()});
  const int n = problem.size(), arm_size = problem.arm_size();
  const Linearisation rows =
      linearise(problem, Eigen::VectorXd::Zero(n), std::vector<bool>(touches.size(), true));

  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(n, n);
  for (int i = 0; i < n; ++i)
    information(i, i) = std::pow(std::max(problem.unknowns()[i].prior_weight, kNoPriorWeight), 2);
  const auto lengths = rows.jacobian.bottomRows(rows.jacobian.rows() - rows.length_row);
  information += lengths.transpose() * lengths;
  Eigen::MatrixXd covariance = information.llt().solve(Eigen::MatrixXd::Identity(n, n));
  Eigen::VectorXd scale(arm_size);
  for (int i = 0; i < arm_size; ++i) scale[i] = problem.unknowns()[i].scale;
  const auto poses = workspace_poses(arm, kPoses, kRegionSeed);
  const Eigen::MatrixXd moves = aligned_moves(arm, poses, nullptr, scale);
  const Eigen::MatrixXd weight = moves.transpose() * moves;

  Choice choice;
  std::vector<bool> taken(candidates.size(), false);
  std::vector<Held> held(cell.targets.size());
  const auto is_sphere = [&](std::size_t t) { return cell.targets[t].kind == TargetKind::kSphere; };
  const auto direction = [&](std::size_t c) -> Eigen::Vector3d {
    return (arm.position(problem.pose(c), nullptr) - centres[candidates[c].target])
        .stableNormalized();
  };
  for (int k = 0; k < count; ++k) {
    int owed = 0, few = 0;
    for (std::size_t t = 0; t < held.size(); ++t) {
      if (!is_sphere(t)) continue;
      owed += held[t].owed(least_per_target);
      few += std::max(0, least_per_target - held[t].count());
    }
    const bool only_few = few > 0 && few >= count - k;
    const bool only_owed = owed > 0 && owed >= count - k;
    double best = -1.0;
    std::size_t pick = candidates.size();
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      const Held& own = held[candidates[c].target];
      if (taken[c] || (only_few && own.count() >= least_per_target) ||
          (only_owed && own.owed(least_per_target) == 0))
        continue;
      const auto g = rows.jacobian.row(static_cast<Eigen::Index>(c));
      const Eigen::VectorXd sg = covariance * g.transpose();
      const auto arm_part = sg.head(arm_size);
      double gain = arm_part.dot(weight * arm_part) / (1.0 + g.dot(sg));
      if (only_owed && own.count() >= least_per_target - kForSpread)
        gain *= own.in_worst(direction(c));
      if (gain > best) {
        best = gain;
        pick = c;
      }
    }
    if (pick == candidates.size()) break;
    const auto g = rows.jacobian.row(static_cast<Eigen::Index>(pick));
    const Eigen::VectorXd sg = covariance * g.transpose();
    covariance -= sg * sg.transpose() / (1.0 + g.dot(sg));
    taken[pick] = true;
    held[candidates[pick].target].add(direction(pick));
    choice.picked.push_back(pick);
  }
  choice.predicted_m3_m =
      predicted_mean_error_m(moves, covariance.topLeftCorner(arm_size, arm_size));
  return choice;
}

}  // namespace cellcal::calib
