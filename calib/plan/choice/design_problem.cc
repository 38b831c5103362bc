#include "calib/plan/choice/design_problem.h"

#include <algorithm>
#include <cmath>

#include "calib/linear/cholesky.h"
#include "calib/model/units.h"
#include "calib/problem/problem.h"
#include "calib/problem/solve.h"
#include "calib/result/level.h"
#include "calib/uncertainty/region.h"

namespace cellcal::calib {

namespace {

constexpr int kPoses = 200;
constexpr double kLimitMarginRad = 0.05;
/// Of the compliance that is assumed where the file states none: what most arms have.
constexpr double kUsualCompliance = 0.3;
/// What the evidence leaves possible after some tens of touches, in the mean.
constexpr double kUsualRippleRad = 5.0 * kRadPerArcsec;
/// Centres without a prior: a metre, in prior units, is no information.
constexpr double kNoPriorWeight = 1e-2;

bool gives(const Cell& cell) {
  return std::any_of(cell.robot.joints.begin(), cell.robot.joints.end(),
                     [](const Joint& joint) { return joint.compliance_sigma_rad_per_nm > 0.0; });
}

/// How the tips of the postures move.
Eigen::MatrixXd moves(const ArmModel& arm, const std::vector<JointVector>& poses,
                      const Eigen::VectorXd& scale, const AccuracyRegion& region) {
  if (region.kind != AccuracyRegion::Kind::kTool) return aligned_moves(arm, poses, nullptr, scale);
  // Of the tip against the flange: no motion of the base is in it.
  Eigen::MatrixXd result(3 * static_cast<Eigen::Index>(poses.size()), arm.size());
  Eigen::Matrix3Xd jacobian(3, arm.size());
  for (std::size_t k = 0; k < poses.size(); ++k) {
    arm.position(arm.prepare(poses[k]), nullptr, jacobian);
    result.middleRows<3>(3 * static_cast<Eigen::Index>(k)) = jacobian * scale.asDiagonal();
  }
  for (int i = 0; i < arm.size(); ++i)
    if (const int joint = arm.parameters()[static_cast<std::size_t>(i)].joint;
        joint >= 0 && joint + 1 < arm.joint_count())
      result.col(i).setZero();
  return result;
}

std::vector<JointVector> postures(const Problem& problem, const std::vector<Candidate>& candidates,
                                  const AccuracyRegion& region) {
  std::vector<JointVector> touches;
  std::vector<Eigen::Vector3d> centres;
  for (const Candidate& c : candidates) touches.push_back(c.contact);
  for (const TargetBlock& block : problem.blocks())
    centres.push_back(problem.cell().targets[block.target].centre_m);
  return accuracy_region_postures(region, problem.arm(), touches, centres, kLimitMarginRad, kPoses);
}

}  // namespace

DesignProblem design_problem(const Cell& stated, const std::vector<Candidate>& candidates,
                             const AccuracyRegion& region) {
  // With what the geometry lacks: touches are chosen for the arm as it will be judged.
  const Cell cell = at_level(stated, {gives(stated) ? 1.0 : kUsualCompliance, 1.0, 0.0},
                             {});  // of the first tool
  DesignProblem design;
  design.arm = std::make_shared<const ArmModel>(cell);
  const ArmModel& arm = *design.arm;
  std::vector<Touch> touches;
  for (const Candidate& c : candidates) {
    const Target& target = cell.targets[c.target];
    Touch touch;
    touch.joint_rad = c.contact;
    touch.target = target.id;
    touches.push_back(std::move(touch));
  }
  std::vector<TargetPlace> places;
  for (const Target& target : cell.targets) {
    places.emplace_back(target.centre_m);
    if (target.kind != TargetKind::kPlane) continue;
    const Eigen::Vector3d across = target.normal.unitOrthogonal();
    places.back().axes << across, target.normal.cross(across), target.normal;
  }
  const Problem problem(cell, arm, touches, places, kUsualRippleRad);
  const int n = problem.size();
  const Linearisation rows =
      linearise(problem, Eigen::VectorXd::Zero(n), std::vector<bool>(touches.size(), true));
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(n, n);
  for (int i = 0; i < n; ++i)
    information(i, i) = std::pow(
        std::max(problem.unknowns()[static_cast<std::size_t>(i)].prior_weight, kNoPriorWeight), 2);
  const auto lengths = rows.jacobian.bottomRows(rows.jacobian.rows() - rows.length_row);
  information += lengths.transpose() * lengths;
  design.rows = rows.jacobian.topRows(rows.length_row);
  design.covariance_u = Cholesky(information).inverse();
  design.scale.resize(arm.size());
  for (int i = 0; i < arm.size(); ++i)
    design.scale[i] = problem.unknowns()[static_cast<std::size_t>(i)].scale;
  design.ripple_rad = region.kind == AccuracyRegion::Kind::kTool ? 0.0 : kUsualRippleRad;
  design.postures = postures(problem, candidates, region);
  design.moves_m = moves(arm, design.postures, design.scale, region);
  return design;
}

}  // namespace cellcal::calib
