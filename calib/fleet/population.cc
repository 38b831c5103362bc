#include "calib/fleet/population.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "calib/model/median.h"

namespace cellcal::calib {

namespace {

/// Of chi^2: honest arms are beyond it once in 16 000 times.
constexpr double kGate = 4.0;
constexpr int kRounds = 20;
/// Log odds, beside the number of pairs that it might have been.
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

/// All spreads times one factor, so that half of the arms are farther than expected. What the robot file counts for
/// would have few arms, all nearer to it than it states, look too near.
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

/// Under the spreads of most.
void measure(const std::vector<ArmRows>& arms, const std::vector<bool>& among, const Groups& groups,
             const LogSpreads& spreads, Population& p) {
  p.chi2 = chi2_of(arms, groups, scaled_to_median(arms, among, groups, spreads));
  p.far = deviates(arms, p.chi2);
}

/// The half of them that is least far off.
std::vector<bool> nearest_half(const std::vector<double>& far, const std::vector<bool>& among) {
  const double middle = median_of(far, among);
  std::vector<bool> half(far.size());
  for (std::size_t k = 0; k < far.size(); ++k) half[k] = among[k] && far[k] <= middle;
  return half;
}

/// Wider where most arms scatter more than normal ones.
std::vector<bool> within_gate(const std::vector<double>& far, const std::vector<bool>& among) {
  std::vector<double> scatter;
  for (const double u : far) scatter.push_back(std::abs(u) / kNormalMedian);
  const double gate = kGate * std::max(1.0, median_of(scatter, among));
  std::vector<bool> near(far.size());
  for (std::size_t k = 0; k < far.size(); ++k) near[k] = among[k] && std::abs(far[k]) <= gate;
  return near;
}

/// Spreads and arms in turn.
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

/// What the other arm's touches foresee of this one's, roughly: whether asking is worth it.
bool may_be(const ArmRows& arm, const Eigen::VectorXd& errors_of_other) {
  return (arm.values - arm.rows * errors_of_other).squaredNorm() < 0.5 * arm.values.squaredNorm();
}

/// Most likely errors of each arm, in drawn sigmas.
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
