#include "calib/priors/spreads.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "calib/model/linear.h"
#include "calib/result/fleet_priors.h"

namespace cellcal::calib {

namespace {

/// Prior similarity of the joints, as 1 sigma of the logarithm: common to a kind, and independent for each
/// joint.
constexpr double kCommonSigma = 0.2, kOwnSigma = 0.3;
/// Range of the spreads, a thirtieth to thirty times the stated one: beyond it the nominal geometry
/// does not apply.
constexpr double kFarthest = 3.4;
constexpr double kLongestStep = 0.5;
constexpr double kSettled = 1e-6;
constexpr int kMostSteps = 60;
constexpr double kNever = std::numeric_limits<double>::infinity();

Eigen::VectorXd variances(const Groups& groups, const LogSpreads& spreads) {
  Eigen::VectorXd t(groups.errors());
  for (Eigen::Index i = 0; i < t.size(); ++i)
    t[i] = std::exp(2.0 * spreads[groups.of_error[static_cast<std::size_t>(i)]]);
  return t;
}

Cholesky predicted(const ArmRows& arm, const Eigen::VectorXd& t) {
  Eigen::MatrixXd v = arm.rows * t.asDiagonal() * arm.rows.transpose();
  v.diagonal().array() += 1.0;
  return Cholesky(v);
}

/// Prior of the logarithms of the spreads.
struct HyperPrior {
  Eigen::MatrixXd alike;      ///< inverse covariance
  Eigen::ArrayXd drawn_arms;  ///< weight of the robot file, in errors per group

  double log_density(const LogSpreads& at) const {
    return -0.5 * at.dot(alike * at) -
           (drawn_arms * (at.array() + 0.5 * (-2.0 * at.array()).exp())).sum();
  }
  Eigen::VectorXd score(const LogSpreads& at) const {
    return (drawn_arms * ((-2.0 * at.array()).exp() - 1.0)).matrix() - alike * at;
  }
  Eigen::MatrixXd curvature(const LogSpreads& at) const {
    Eigen::MatrixXd c = alike;
    c.diagonal().array() += 2.0 * drawn_arms * (-2.0 * at.array()).exp();
    return c;
  }
  /// (90) for the robot file's weight: errors as large as the spreads, not as stated.
  Eigen::MatrixXd information() const { return curvature(LogSpreads::Zero(drawn_arms.size())); }
};

HyperPrior hyper_prior(const Groups& groups) {
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(groups.size(), groups.size());
  for (Eigen::Index g = 0; g < groups.size(); ++g)
    for (Eigen::Index h = 0; h < groups.size(); ++h)
      if (groups.kind[static_cast<std::size_t>(g)] == groups.kind[static_cast<std::size_t>(h)])
        covariance(g, h) = kCommonSigma * kCommonSigma + (g == h ? kOwnSigma * kOwnSigma : 0.0);
  HyperPrior prior{Cholesky(covariance).inverse(), Eigen::ArrayXd::Zero(groups.size())};
  for (const Eigen::Index g : groups.of_error) prior.drawn_arms[g] += kDrawnArms;
  return prior;
}

struct Derivatives {
  double log_evidence = 0.0;
  Eigen::VectorXd score;
  Eigen::MatrixXd information;   ///< expected
  Eigen::MatrixXd score_square;  ///< sum over the arms
};

void add(const ArmRows& arm, const Groups& groups, const Eigen::VectorXd& t, Derivatives& d) {
  const Cholesky v = predicted(arm, t);
  if (!v.positive()) return;
  const Eigen::MatrixXd white = v.whitened(arm.rows);  // chol(V_e)^-1 J_e
  const Eigen::VectorXd y = v.whitened(arm.values);
  d.log_evidence -= 0.5 * (v.log_det() + y.squaredNorm());  // (88)
  const Eigen::VectorXd z = white.transpose() * y;
  const Eigen::MatrixXd p = white.transpose() * white;
  Eigen::VectorXd score = Eigen::VectorXd::Zero(groups.size());
  for (Eigen::Index i = 0; i < t.size(); ++i) {
    const Eigen::Index g = groups.of_error[static_cast<std::size_t>(i)];
    score[g] += t[i] * (z[i] * z[i] - p(i, i));  // (89)
    for (Eigen::Index j = 0; j < t.size(); ++j)
      d.information(g, groups.of_error[static_cast<std::size_t>(j)]) +=
          2.0 * t[i] * t[j] * p(i, j) * p(i, j);  // (90)
  }
  d.score += score;
  d.score_square += score * score.transpose();
}

Derivatives derivatives(const std::vector<ArmRows>& arms, const std::vector<bool>& use,
                        const Groups& groups, const LogSpreads& spreads) {
  const Eigen::Index n = groups.size();
  Derivatives d{0.0, Eigen::VectorXd::Zero(n), Eigen::MatrixXd::Zero(n, n),
                Eigen::MatrixXd::Zero(n, n)};
  const Eigen::VectorXd t = variances(groups, spreads);
  for (std::size_t k = 0; k < arms.size(); ++k)
    if (use[k]) add(arms[k], groups, t, d);
  return d;
}

/// In sigmas of chi^2: exceeded by one in 16 000 consistent arms.
constexpr double kGate = 4.0;
constexpr int kRounds = 20;
/// Log odds, in addition to the number of candidate pairs.
constexpr double kSameArm = 10.0;

std::vector<double> chi2_of(const std::vector<ArmRows>& arms, const Groups& groups,
                            const LogSpreads& spreads) {
  std::vector<double> all;
  for (const ArmRows& arm : arms) all.push_back(fit_of(arm, groups, spreads).chi2);
  return all;
}

std::vector<double> deviates(const std::vector<ArmRows>& arms, const std::vector<double>& chi2) {
  std::vector<double> all;
  for (std::size_t k = 0; k < arms.size(); ++k)
    all.push_back(deviate(chi2[k], arms[k].values.size()));
  return all;
}

double median_of(const std::vector<double>& values, const std::vector<bool>& among) {
  std::vector<double> some;
  for (std::size_t k = 0; k < values.size(); ++k)
    if (among[k]) some.push_back(values[k]);
  return median(std::move(some));
}

/// Scales all spreads so that half of the arms lie beyond the expected distance. Otherwise the robot file's weight
/// would make few arms, all nearer than stated, look too near.
LogSpreads scaled_to_median(const std::vector<ArmRows>& arms, const std::vector<bool>& among,
                            const Groups& groups, const LogSpreads& spreads) {
  double low = -3.0, high = 3.0;
  constexpr int kHalvings = 20;
  const auto with = [&](double by) -> LogSpreads { return spreads.array() + by; };
  for (int k = 0; k < kHalvings; ++k) {
    const double middle = (low + high) / 2.0;
    const bool far = median_of(deviates(arms, chi2_of(arms, groups, with(middle))), among) > 0.0;
    (far ? low : high) = middle;
  }
  return with((low + high) / 2.0);
}

/// Distances under the spreads of the majority.
void measure(const std::vector<ArmRows>& arms, const std::vector<bool>& among, const Groups& groups,
             const LogSpreads& spreads, Population& p) {
  p.chi2 = chi2_of(arms, groups, scaled_to_median(arms, among, groups, spreads));
  p.far = deviates(arms, p.chi2);
}

/// The half of the arms with the smallest distances.
std::vector<bool> nearest_half(const std::vector<double>& far, const std::vector<bool>& among) {
  const double middle = median_of(far, among);
  std::vector<bool> half(far.size());
  for (std::size_t k = 0; k < far.size(); ++k) half[k] = among[k] && far[k] <= middle;
  return half;
}

/// Widened if most arms scatter more than normal.
std::vector<bool> within_gate(const std::vector<double>& far, const std::vector<bool>& among) {
  std::vector<double> scatter;
  for (const double u : far) scatter.push_back(std::abs(u) / kNormalMedian);
  const double gate = kGate * std::max(1.0, median_of(scatter, among));
  std::vector<bool> near(far.size());
  for (std::size_t k = 0; k < far.size(); ++k) near[k] = among[k] && std::abs(far[k]) <= gate;
  return near;
}

/// Alternates between estimating the spreads and selecting the arms.
void settle(const std::vector<ArmRows>& arms, const std::vector<bool>& among, const Groups& groups,
            Population& p) {
  for (int round = 0; round < kRounds; ++round) {
    p.spreads = fit_spreads(arms, p.use, groups, p.spreads.mode);
    measure(arms, among, groups, p.spreads.mode, p);
    std::vector<bool> next = within_gate(p.far, among);
    if (next == p.use) break;
    p.use = std::move(next);
  }
}

ArmRows together(const ArmRows& a, const ArmRows& b) {
  ArmRows both;
  both.rows.resize(a.rows.rows() + b.rows.rows(), a.rows.cols());
  both.rows << a.rows, b.rows;
  both.values.resize(both.rows.rows());
  both.values << a.values, b.values;
  return both;
}

/// Rough prediction of this arm's touches from the other's: a cheap pretest.
bool may_be(const ArmRows& arm, const Eigen::VectorXd& errors_of_other) {
  return (arm.values - arm.rows * errors_of_other).squaredNorm() < 0.5 * arm.values.squaredNorm();
}

/// Most likely errors of each arm, in stated sigmas.
std::vector<Eigen::VectorXd> errors(const std::vector<ArmRows>& arms, const Groups& groups,
                                    const LogSpreads& spreads) {
  std::vector<Eigen::VectorXd> all;
  for (const ArmRows& arm : arms) all.push_back(likely_errors(arm, groups, spreads));
  return all;
}

void find_same_arms(const std::vector<ArmRows>& arms, const Groups& groups, Population& p) {
  const auto likely = errors(arms, groups, p.spreads.mode);
  const double odds = kSameArm + 2.0 * std::log(static_cast<double>(arms.size()));
  for (std::size_t b = 1; b < arms.size(); ++b)
    for (std::size_t a = 0; a < b && p.same_as[b] == b; ++a) {
      if (p.same_as[a] != a || !may_be(arms[b], likely[a])) continue;
      const double both = fit_of(together(arms[a], arms[b]), groups, p.spreads.mode).log_evidence;
      const double each = fit_of(arms[a], groups, p.spreads.mode).log_evidence +
                          fit_of(arms[b], groups, p.spreads.mode).log_evidence;
      if (both - each > odds) p.same_as[b] = a;
    }
}

}  // namespace

ArmFit fit_of(const ArmRows& arm, const Groups& groups, const LogSpreads& spreads) {
  const Cholesky v = predicted(arm, variances(groups, spreads));
  // Rows with a ratio of 1e15 do not come from touches.
  if (!v.positive()) return {kNever, -kNever};
  const double chi2 = v.whitened(arm.values).squaredNorm();
  return {chi2, -0.5 * (v.log_det() + chi2)};
}

Eigen::VectorXd likely_errors(const ArmRows& arm, const Groups& groups, const LogSpreads& spreads) {
  const Eigen::VectorXd t = variances(groups, spreads);
  return t.asDiagonal() * (arm.rows.transpose() * predicted(arm, t).solve(arm.values));
}

double deviate(double chi2, Eigen::Index degrees_of_freedom) {
  const double share = 2.0 / (9.0 * static_cast<double>(degrees_of_freedom));
  return (std::cbrt(chi2 / static_cast<double>(degrees_of_freedom)) - (1.0 - share)) /
         std::sqrt(share);
}

SpreadFit fit_spreads(const std::vector<ArmRows>& arms, const std::vector<bool>& use,
                      const Groups& groups, const LogSpreads& start) {
  const HyperPrior prior = hyper_prior(groups);
  SpreadFit fit;
  fit.mode = start;
  Derivatives d = derivatives(arms, use, groups, fit.mode);
  for (int step = 0; step < kMostSteps; ++step) {
    const Eigen::VectorXd way = Cholesky(d.information + prior.curvature(fit.mode))
                                    .solve(Eigen::VectorXd(d.score + prior.score(fit.mode)));
    double length = std::min(1.0, kLongestStep / std::max(kSettled, way.lpNorm<Eigen::Infinity>()));
    const double before = d.log_evidence + prior.log_density(fit.mode);
    LogSpreads next = fit.mode;
    // Scoring steps usually increase the likelihood; otherwise the step is halved.
    for (int half = 0; half < 10; ++half, length /= 2.0) {
      next = (fit.mode + length * way).cwiseMax(-kFarthest).cwiseMin(kFarthest);
      d = derivatives(arms, use, groups, next);
      if (d.log_evidence + prior.log_density(next) >= before) break;
    }
    const double moved = (next - fit.mode).lpNorm<Eigen::Infinity>();
    fit.mode = next;
    if (moved < kSettled) break;
  }
  const Eigen::MatrixXd before = prior.information();
  const Eigen::MatrixXd unknown = Cholesky(d.information + before).inverse();
  const Eigen::MatrixXd sandwich = unknown * (d.score_square + before) * unknown;
  fit.sigma = unknown.diagonal().cwiseMax(sandwich.diagonal()).cwiseSqrt();
  fit.arms = Eigen::VectorXd::Zero(groups.size());
  for (const Eigen::Index g : groups.of_error) fit.arms[g] += 2.0;
  fit.arms = d.information.diagonal().cwiseQuotient(fit.arms);
  return fit;
}

Population population_of(const std::vector<ArmRows>& arms, const Groups& groups) {
  Population p;
  p.same_as.resize(arms.size());
  std::iota(p.same_as.begin(), p.same_as.end(), std::size_t{0});
  std::vector<bool> among(arms.size(), true);
  p.spreads.mode = LogSpreads::Zero(groups.size());
  for (int half = 0; half < 2; ++half) {
    measure(arms, among, groups, p.spreads.mode, p);
    p.use = nearest_half(p.far, among);
    p.spreads = fit_spreads(arms, p.use, groups, p.spreads.mode);
  }
  measure(arms, among, groups, p.spreads.mode, p);
  p.use = within_gate(p.far, among);
  settle(arms, among, groups, p);
  find_same_arms(arms, groups, p);
  for (std::size_t k = 0; k < arms.size(); ++k) {
    among[k] = p.same_as[k] == k;
    p.use[k] = p.use[k] && among[k];
  }
  settle(arms, among, groups, p);
  return p;
}

}  // namespace cellcal::calib
