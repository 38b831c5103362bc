#include "calib/plan/check_choice.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "calib/check/explain.h"
#include "calib/check/mastered.h"
#include "calib/check/tcp_check.h"
#include "calib/estimate/region.h"
#include "calib/model/kinematics.h"
#include "calib/model/linear.h"
#include "calib/model/long_work.h"
#include "calib/result/calibration.h"
#include "calib/result/level.h"

namespace cellcal::calib {

namespace {

/// Effect at the tip of all other possible changes.
constexpr double kElseM = 0.1e-3;
/// Prior of a shift of the tool, and of a zero; avoids a singular information matrix for the first touches.
constexpr double kToolM = 1e-3, kZeroRad = 0.02;
/// A shift similar to another change is still detected, but attributed wrongly.
constexpr double kDistinctionWeight = 0.3;
constexpr int kRounds = 3;  ///< of exchange

/// Rows of all candidates, from which those of any set are selected.
class CheckDesign {
 public:
  /// The zeros of these joints; empty: a shift of the tool.
  CheckDesign(const Calibration& calibration, const std::vector<Candidate>& candidates,
              const std::vector<std::string>& joints)
      : prior_(joints.empty() ? kToolM : kZeroRad) {
    std::vector<Touch> touches;
    for (const Candidate& candidate : candidates) {
      touches.emplace_back();
      touches.back().joint_rad = candidate.contact;
      touches.back().target = calibration.cell.targets[candidate.target].id;
    }
    const Foresight foresight = foresee(calibration, touches);
    alone_ = foresight.covariance_m2();
    beside_ = foresight.passing_m2;  // as in checks after earlier ones
    for (const PossibleChange& change : possible_changes(calibration, foresight.contacts)) {
      if (change.kind == ChangeKind::kTouch) continue;
      const Eigen::MatrixXd by = columns_of(change, foresight.contacts);
      if (change.kind == ChangeKind::kTool && joints.empty()) {
        wanted_ = by;
        continue;
      }
      if (change.kind == ChangeKind::kJoint && std::ranges::find(joints, change.name) != joints.end())
        continue;
      const double size = kElseM / std::sqrt(by.rowwise().squaredNorm().maxCoeff());
      beside_.noalias() += size * size * by * by.transpose();
    }
    if (!joints.empty()) wanted_ = by_zeros(calibration, joints, foresight.contacts);
  }

  /// Remaining variance of the tool [m^2], or of the zeros [rad^2], under the set.
  double unknown(const std::vector<std::size_t>& set) const {
    return left(set, alone_) + kDistinctionWeight * left(set, beside_);
  }

 private:
  double left(const std::vector<std::size_t>& set, const Eigen::MatrixXd& covariance) const {
    const auto n = static_cast<Eigen::Index>(set.size());
    Eigen::MatrixXd v(n, n), g(n, wanted_.cols());
    for (Eigen::Index a = 0; a < n; ++a) {
      const auto row = static_cast<Eigen::Index>(set[static_cast<std::size_t>(a)]);
      g.row(a) = wanted_.row(row);
      for (Eigen::Index b = 0; b <= a; ++b)
        v(a, b) = covariance(row, static_cast<Eigen::Index>(set[static_cast<std::size_t>(b)]));
    }
    const Eigen::MatrixXd by = Cholesky(v).whitened(g);
    Eigen::MatrixXd information = by.transpose() * by;
    information.diagonal().array() += 1.0 / (prior_ * prior_);
    return Cholesky(information).inverse().trace();
  }

  double prior_;  ///< 1 sigma
  Eigen::MatrixXd alone_, beside_, wanted_;
};

class Picker {
 public:
  /// `every_target`: touches each target at least once.
  Picker(const std::vector<Candidate>& candidates, const CheckDesign& design,
         const std::function<bool(std::size_t)>& possible, bool every_target)
      : candidates_(candidates), design_(design), possible_(possible), every_target_(every_target) {}

  /// The feasible candidate that, with the others, leaves the smallest uncertainty; of a target without touches
  /// among them, if there is one.
  std::optional<std::size_t> best_alternative(const std::vector<std::size_t>& others) const {
    std::set<std::size_t> touched, all;
    for (const Candidate& one : candidates_) all.insert(one.target);
    for (const std::size_t c : others) touched.insert(candidates_[c].target);
    std::vector<std::pair<double, std::size_t>> by_unknown;
    std::vector<std::size_t> set = others;
    set.push_back(0);
    for (std::size_t c = 0; c < candidates_.size(); ++c) {
      poll_cancelled();
      if (std::ranges::find(others, c) != others.end()) continue;
      if (every_target_ && touched.size() < all.size() && touched.contains(candidates_[c].target)) continue;
      set.back() = c;
      by_unknown.emplace_back(design_.unknown(set), c);
    }
    std::ranges::sort(by_unknown);
    for (const auto& [unknown, c] : by_unknown)
      if (possible_(c)) return c;
    return std::nullopt;
  }

 private:
  const std::vector<Candidate>& candidates_;
  const CheckDesign& design_;
  const std::function<bool(std::size_t)>& possible_;
  bool every_target_;
};

/// One after the other, then exchanged.
std::vector<std::size_t> pick(const Picker& picker, int count) {
  std::vector<std::size_t> picked;
  while (static_cast<int>(picked.size()) < count) {
    const auto next = picker.best_alternative(picked);
    if (!next) return picked;
    picked.push_back(*next);
  }
  for (int round = 0; round < kRounds; ++round)
    for (std::size_t& place : picked) {
      std::vector<std::size_t> others;
      for (const std::size_t& one : picked)
        if (&one != &place) others.push_back(one);
      place = picker.best_alternative(others).value_or(place);
    }
  return picked;
}

}  // namespace

std::vector<std::size_t> choose_check(const Calibration& calibration,
                                      const std::vector<Candidate>& candidates, int count,
                                      const std::function<bool(std::size_t)>& possible) {
  const CheckDesign design(calibration, candidates, {});
  return pick(Picker(candidates, design, possible, true), count);
}

std::vector<std::size_t> choose_for_zeros(const Calibration& calibration,
                                          const std::vector<std::string>& joints,
                                          const std::vector<Candidate>& candidates, int count,
                                          const std::function<bool(std::size_t)>& possible) {
  const CheckDesign design(calibration, candidates, joints);
  return pick(Picker(candidates, design, possible, false), count);
}

namespace {

constexpr int kUpdatePoses = 60;
constexpr unsigned kCheckSeed = 20240924;

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

/// Objective: the tip over the workspace, without base motion, and every sphere's centre; each as mean
/// square.
Eigen::MatrixXd wanted(const Calibration& c) {
  const ArmModel arm(at_level(c.cell, c.level));
  const Eigen::VectorXd x = arm_values(arm, c);
  const Eigen::MatrixXd moves = aligned_moves(arm, workspace_poses(arm, kUpdatePoses, kCheckSeed),
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

/// Covariance between the calibration's parameters and the residuals of the touches.
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
