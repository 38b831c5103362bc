#include "calib/identify/evidence.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/identify/solve.h"

namespace cellcal::calib {

namespace {

constexpr double kRadPerArcsec = std::numbers::pi / 180.0 / 3600.0;

struct Prior {
  double value, probability;
};
/// Smooth transmission error relative to the usual: a factor of two either way is common.
constexpr Prior kTransmission[] = {
    {0.0, 0.25}, {0.35, 0.15}, {0.7, 0.25}, {1.4, 0.20}, {2.8, 0.15}};
constexpr Prior kRipple[] = {{0.0, 0.4}, {5.0 * kRadPerArcsec, 0.4}, {15.0 * kRadPerArcsec, 0.2}};
constexpr double kComplianceProbability = 0.7;
/// More rows tell the levels apart no better.
constexpr std::size_t kMostTouches = 2000;
/// Levels closer than this in log evidence are not told apart (a Bayes factor of 2.7).
constexpr double kUndecided = 0.0;
/// Precision of unknowns without a prior; the same in every level, so it cancels.
constexpr double kFlat = 1e-8;

}  // namespace

std::vector<LevelEvidence> weigh_levels(const Problem& problem, const Eigen::VectorXd& u,
                                        const std::vector<bool>& use) {
  std::vector<bool> some = use;
  std::size_t count = 0;
  const auto total = static_cast<std::size_t>(std::count(use.begin(), use.end(), true));
  const std::size_t stride = total / kMostTouches + 1;
  for (std::size_t i = 0; i < some.size(); ++i)
    if (some[i] && count++ % stride != 0) some[i] = false;
  const Linearisation linear = linearise(problem, u, some);
  const Eigen::VectorXd pseudo = linear.jacobian * u - linear.residual;  // what J u should be
  const int n = problem.size();
  Eigen::VectorXd mean(n), precision(n);
  std::vector<bool> gives(n, false), wobbles(n, false);
  bool any_gives = false;
  for (int i = 0; i < n; ++i) {
    const Unknown& unknown = problem.unknowns()[i];
    precision[i] = unknown.prior_weight > 0.0 ? std::pow(unknown.prior_weight, 2) : kFlat;
    mean[i] = unknown.prior_mean_u;
    if (i >= problem.arm_size()) continue;
    const ArmParameterKind kind = problem.arm().parameters()[i].kind;
    gives[i] = kind == ArmParameterKind::kCompliance;
    wobbles[i] = kind == ArmParameterKind::kCosine || kind == ArmParameterKind::kSine;
    any_gives = any_gives || gives[i];
  }

  std::vector<LevelEvidence> result;
  for (const Prior& ripple : kRipple) {
    Eigen::VectorXd weight = Eigen::VectorXd::Ones(pseudo.size());
    for (const auto& [touch, row] : linear.touch_row)
      for (int k = 0; k < problem.rows(touch); ++k) {
        const double sigma = problem.sigma_m(touch);
        const double joint_noise = ripple.value * problem.joint_lever_m(touch);
        weight[row + k] = sigma * sigma / (sigma * sigma + joint_noise * joint_noise);
      }
    const Eigen::MatrixXd weighted = weight.asDiagonal() * linear.jacobian;
    const Eigen::MatrixXd gram = linear.jacobian.transpose() * weighted;
    const Eigen::VectorXd right = weighted.transpose() * pseudo;
    const double square = pseudo.dot(weight.asDiagonal() * pseudo);
    for (const bool compliance : {true, false}) {
      if (!compliance && !any_gives) continue;
      for (const Prior& transmission : kTransmission) {
        // A level scales the prior of some unknowns: in its own prior units their columns grow.
        std::vector<int> kept;
        Eigen::VectorXd factor(n);
        for (int i = 0; i < n; ++i) {
          factor[i] = wobbles[i] ? transmission.value : gives[i] && !compliance ? 0.0 : 1.0;
          if (factor[i] > 0.0) kept.push_back(i);
        }
        const auto m = static_cast<Eigen::Index>(kept.size());
        Eigen::MatrixXd information(m, m);
        Eigen::VectorXd b(m);
        double prior_square = 0.0, log_prior = 0.0;
        for (Eigen::Index r = 0; r < m; ++r) {
          const int i = kept[static_cast<std::size_t>(r)];
          for (Eigen::Index c = 0; c <= r; ++c) {
            const int k = kept[static_cast<std::size_t>(c)];
            information(r, c) = factor[i] * factor[k] * gram(i, k);
          }
          information(r, r) += precision[i];
          b[r] = factor[i] * right[i] + precision[i] * mean[i];
          prior_square += precision[i] * mean[i] * mean[i];
          log_prior += std::log(precision[i]);
        }
        const Eigen::LLT<Eigen::MatrixXd, Eigen::Lower> llt(information);
        if (llt.info() != Eigen::Success) continue;
        const double log_det = 2.0 * llt.matrixLLT().diagonal().array().log().sum();
        const double misfit = square + prior_square - b.dot(llt.solve(b));
        double log_evidence = 0.5 * (weight.array().log().sum() - misfit - log_det + log_prior);
        log_evidence += std::log(ripple.probability) + std::log(transmission.probability);
        if (any_gives)
          log_evidence +=
              std::log(compliance ? kComplianceProbability : 1.0 - kComplianceProbability);
        result.push_back({{compliance, transmission.value, ripple.value}, log_evidence});
      }
    }
  }
  if (result.empty()) result.push_back({});
  std::stable_sort(result.begin(), result.end(),
                   [](const auto& a, const auto& b) { return a.log_evidence > b.log_evidence; });
  return result;
}

ModelLevel choose_level(const std::vector<LevelEvidence>& weighed) {
  ModelLevel best = weighed.front().level;
  // Claiming least: more room for what the model lacks.
  for (const LevelEvidence& other : weighed) {
    if (other.log_evidence < weighed.front().log_evidence - kUndecided) break;
    if (other.level.compliance != best.compliance) continue;
    if (other.level.transmission >= best.transmission && other.level.ripple_rad >= best.ripple_rad)
      best = other.level;
  }
  return best;
}

}  // namespace cellcal::calib
