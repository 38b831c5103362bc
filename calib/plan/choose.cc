#include "calib/plan/choose.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "calib/identify/level.h"
#include "calib/identify/problem.h"
#include "calib/identify/region.h"
#include "calib/identify/solve.h"

namespace cellcal::calib {

namespace {

constexpr int kPoses = 200;
constexpr unsigned kRegionSeed = 7;
/// Centres without a prior: a metre, in prior units, is no information.
constexpr double kNoPriorWeight = 1e-2;

}  // namespace

Choice choose(const Cell& stated, const std::vector<Candidate>& candidates, int count,
              int least_per_target) {
  // With what the geometry lacks: touches are chosen for the arm as it will be judged.
  const Cell cell = at_level(stated, ModelLevel{});
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
  const Problem problem(cell, arm, touches, centres);
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
  std::vector<int> have(cell.targets.size(), 0);
  const int spheres =
      static_cast<int>(std::count_if(cell.targets.begin(), cell.targets.end(), [](const Target& t) {
        return t.kind == TargetKind::kSphere;
      }));
  for (int k = 0; k < count; ++k) {
    int owed = 0;
    for (const Target& target : cell.targets)
      if (target.kind == TargetKind::kSphere)
        owed += std::max(0, least_per_target - have[&target - cell.targets.data()]);
    const bool only_owed = spheres > 0 && owed >= count - k;
    double best = -1.0;
    std::size_t pick = candidates.size();
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      if (taken[c] || (only_owed && have[candidates[c].target] >= least_per_target)) continue;
      const auto g = rows.jacobian.row(static_cast<Eigen::Index>(c));
      const Eigen::VectorXd sg = covariance * g.transpose();
      const auto arm_part = sg.head(arm_size);
      const double gain = arm_part.dot(weight * arm_part) / (1.0 + g.dot(sg));
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
    ++have[candidates[pick].target];
    choice.picked.push_back(pick);
  }
  choice.predicted_m3_m =
      predicted_mean_error_m(moves, covariance.topLeftCorner(arm_size, arm_size));
  return choice;
}

}  // namespace cellcal::calib
