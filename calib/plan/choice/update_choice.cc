#include "calib/plan/choice/update_choice.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "calib/check/known_touches.h"
#include "calib/model/kinematics.h"
#include "calib/result/arm_values.h"
#include "calib/result/level.h"
#include "calib/uncertainty/region.h"

namespace cellcal::calib {

namespace {

constexpr int kUpdatePoses = 60;
constexpr unsigned kSeed = 20240924;

std::vector<Touch> touches_of(const Calibration& c, const std::vector<Candidate>& candidates) {
  std::vector<Touch> touches;
  for (const Candidate& candidate : candidates) {
    touches.emplace_back();
    touches.back().joint_rad = candidate.contact;
    touches.back().target = c.cell.targets[candidate.target].id;
  }
  return touches;
}

Eigen::Index place_of(const Calibration& c, const ParameterKey& key) {
  const auto found = std::ranges::find(c.parameters, key, &ParameterResult::key);
  return found == c.parameters.end() ? -1 : found - c.parameters.begin();
}

/// What is wanted of the parameters: the tip over the workspace, base motion out, and every sphere's centre;
/// each in the mean of squares.
Eigen::MatrixXd wanted(const Calibration& c) {
  const ArmModel arm(at_level(c.cell, c.level));
  const Eigen::VectorXd x = arm_values(arm, c);
  const Eigen::MatrixXd moves = aligned_moves(arm, workspace_poses(arm, kUpdatePoses, kSeed),
                                              x.data(), Eigen::VectorXd::Ones(arm.size())) /
                                std::sqrt(static_cast<double>(kUpdatePoses));
  const auto spheres = static_cast<Eigen::Index>(c.targets.size());
  const auto n = static_cast<Eigen::Index>(c.parameters.size());
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(moves.rows() + 3 * spheres, n);
  for (int i = 0; i < arm.size(); ++i)
    if (const Eigen::Index at = place_of(c, arm.parameters()[static_cast<std::size_t>(i)]); at >= 0)
      rows.col(at).head(moves.rows()) = moves.col(i);
  const double each = 1.0 / std::sqrt(static_cast<double>(std::max<Eigen::Index>(1, spheres)));
  for (Eigen::Index s = 0; s < spheres; ++s)
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t target = c.cell.target_index(c.targets[static_cast<std::size_t>(s)].id);
      const Eigen::Index at = place_of(c, target_parameter(ParameterKind::kCentre, target, axis));
      if (at >= 0) rows(moves.rows() + 3 * s + axis, at) = each;
    }
  return rows;
}

/// Covariance of the calibration's parameters with what touches would be off by.
Eigen::MatrixXd across_m(const Calibration& c, const std::vector<Touch>& touches) {
  const KnownTouches known(c, touches);
  const KnownTouches::RowMajor by_unknowns = known.rows(known.x());
  Eigen::MatrixXd rows =
      Eigen::MatrixXd::Zero(by_unknowns.rows(), static_cast<Eigen::Index>(c.parameters.size()));
  for (std::size_t i = 0; i < known.unknowns().size(); ++i)
    if (const Eigen::Index at = place_of(c, known.unknowns()[i].key); at >= 0)
      rows.col(at) = by_unknowns.col(static_cast<Eigen::Index>(i));
  return c.covariance * rows.transpose();
}

}  // namespace

std::vector<std::size_t> choose_update(const Calibration& believed,
                                       const std::vector<Candidate>& candidates, int count,
                                       const std::function<bool(std::size_t)>& possible) {
  const std::vector<Touch> touches = touches_of(believed, candidates);
  Eigen::MatrixXd foreseen = foresee(believed, touches).covariance_m2();
  Eigen::MatrixXd cross_covariance = wanted(believed) * across_m(believed, touches);
  std::vector<std::size_t> picked;
  while (static_cast<int>(picked.size()) < count) {
    std::vector<std::pair<double, std::size_t>> by_gain;
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      const auto k = static_cast<Eigen::Index>(c);
      by_gain.emplace_back(-cross_covariance.col(k).squaredNorm() / foreseen(k, k), c);  // (84)
    }
    std::ranges::sort(by_gain);
    const auto best = std::ranges::find_if(by_gain, [&](const auto& one) {
      return std::ranges::find(picked, one.second) == picked.end() && possible(one.second);
    });
    if (best == by_gain.end()) return picked;
    picked.push_back(best->second);
    const auto k = static_cast<Eigen::Index>(best->second);
    const Eigen::VectorXd with = foreseen.col(k), cross = cross_covariance.col(k);
    const double variance = foreseen(k, k);
    cross_covariance.noalias() -= cross / variance * with.transpose();  // (84)
    foreseen.noalias() -= with / variance * with.transpose();
  }
  return picked;
}

}  // namespace cellcal::calib
