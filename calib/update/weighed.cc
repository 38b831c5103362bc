#include "calib/update/weighed.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "calib/update/prior.h"

namespace cellcal::calib {

namespace {

/// Who asks for an update has a reason.
constexpr double kNothingBefore = 0.5;
/// Beforehand, in odds: where one thing changed, one time in ten another did as well.
constexpr double kSecondBefore = 0.1;

double most(const std::vector<double>& logs) {
  return logs.empty() ? 0.0 : *std::ranges::max_element(logs);
}

double log_sum(const std::vector<double>& logs) {
  double sum = 0.0;
  for (const double one : logs) sum += std::exp(one - most(logs));
  return most(logs) + std::log(sum);
}

bool same(const PossibleChange& a, const PossibleChange& b) {
  return a.kind == b.kind && a.name == b.name && a.index == b.index;
}

Explanation told(const Weighed& one) {
  Explanation e;
  e.kind = one.change.kind;
  e.name = one.change.name;
  e.touch = e.kind == ChangeKind::kTouch ? one.change.index : 0;
  const Eigen::VectorXd& size = one.how.size;
  if (one.change.size == 1) {
    e.amount = size[0];
    e.sigma = std::sqrt(std::max(0.0, one.how.size_covariance(0, 0)));
  } else if (one.change.size == 3) {
    e.shift_m = size;
    const Eigen::Vector3d along =
        size.norm() > 0.0 ? Eigen::Vector3d(size.normalized()) : Eigen::Vector3d::UnitX();
    e.sigma = std::sqrt(std::max(0.0, along.dot(one.how.size_covariance * along)));
  }
  return e;
}

/// Probability of a chi^2 as large, by the cube root's normal (Wilson and Hilferty 1931).
double chance_of(double chi2, double dof) {
  if (!(dof > 0.0)) return 1.0;
  const double h = 2.0 / (9.0 * dof);
  const double z = (std::cbrt(chi2 / dof) - (1.0 - h)) / std::sqrt(h);
  return 0.5 * std::erfc(z / std::numbers::sqrt2);
}

}  // namespace

std::vector<Weighed> weighed(const Calibration& prior, const TouchEquations& touches) {
  std::vector<PossibleChange> changes = possible_changes(prior, touches.contacts());
  for (PossibleChange& change : changes) change.weight *= 1.0 - kNothingBefore;
  changes.insert(changes.begin(),
                 {ChangeKind::kNothing, "", 0, 0, kNothingBefore, std::vector<double>{1.0}});
  std::vector<Weighed> all;
  std::vector<double> logs;
  for (const PossibleChange& change : changes) {
    const auto of_parameters = moved_by(change, prior);
    if (!of_parameters) continue;
    Eigen::MatrixXd moves = Eigen::MatrixXd::Zero(touches.x().size(), change.size);
    moves.topRows(touches.parameters()) = *of_parameters;
    for (const double usual : change.usual) {
      all.push_back({change, moves, usual, explained(touches, change, moves, usual)});
      logs.push_back(all.back().how.log_evidence +
                     std::log(change.weight / static_cast<double>(change.usual.size())));
    }
  }
  for (std::size_t k = 0; k < all.size(); ++k)
    all[k].probability = std::exp(logs[k] - log_sum(logs));
  return all;  // (80)
}

std::vector<Explanation> explanations(const std::vector<Weighed>& all) {
  std::vector<Explanation> list;
  for (std::size_t k = 0; k < all.size();) {
    const std::size_t first = k;
    std::size_t best = k;
    double probability = 0.0;
    std::vector<double> logs;
    for (; k < all.size() && same(all[k].change, all[first].change); ++k) {
      probability += all[k].probability;
      logs.push_back(all[k].how.log_evidence);
      if (all[k].probability > all[best].probability) best = k;
    }
    list.push_back(told(all[best]));
    list.back().probability = probability;
    list.back().log_likelihood = log_sum(logs) - std::log(static_cast<double>(logs.size())) -
                                 all.front().how.log_evidence;  // over that of nothing
  }
  std::ranges::stable_sort(list, std::greater{}, &Explanation::probability);
  return list;
}

const Weighed& likeliest(const std::vector<Weighed>& all) {
  const Explanation first = explanations(all).front();
  const Weighed* best = nullptr;
  for (const Weighed& one : all) {
    const bool of_it = one.change.kind == first.kind && one.change.name == first.name &&
                       (first.kind != ChangeKind::kTouch || one.change.index == first.touch);
    if (of_it && (best == nullptr || one.probability > best->probability)) best = &one;
  }
  return *best;
}

Sufficient sufficient(const Weighed& one, const std::vector<Weighed>& all,
                      std::size_t touches_set_aside) {
  Sufficient result;
  result.chi2 = one.how.chi2();
  result.degrees_of_freedom = static_cast<double>(one.how.off_m.size() - one.change.size) -
                              static_cast<double>(touches_set_aside);
  result.by_chance = chance_of(result.chi2, result.degrees_of_freedom);  // (81)
  // Another thing beside it, linearised where the first has brought the arm.
  const Eigen::VectorXd off = one.how.foreseen.whitened(one.how.off_m);
  std::vector<double> logs;
  double best = -std::numeric_limits<double>::infinity();
  for (const Weighed& other : all) {
    if (other.change.size == 0 || same(other.change, one.change)) continue;
    Eigen::MatrixXd by = one.how.rows * other.moves;
    if (other.change.kind == ChangeKind::kTouch)
      by(static_cast<Eigen::Index>(other.change.index), 0) = -1.0;
    by = one.how.foreseen.whitened(by);
    const double variance = other.usual * other.usual;
    Eigen::MatrixXd information = by.transpose() * by;
    information.diagonal().array() += 1.0 / variance;
    const Cholesky factor(information);
    const Eigen::VectorXd pull = by.transpose() * off;
    const double log_ratio =
        0.5 * (pull.dot(factor.solve(pull)) - factor.log_det() -
               static_cast<double>(other.change.size) * std::log(variance));  // (82)
    logs.push_back(log_ratio + std::log(kSecondBefore * other.change.weight /
                                        static_cast<double>(other.change.usual.size())));
    if (logs.back() <= best) continue;
    best = logs.back();
    Weighed second{other.change, {}, other.usual, {}};
    second.how.size = factor.solve(pull);
    second.how.size_covariance = factor.inverse();
    result.second = told(second);
  }
  result.log_odds_second = log_sum(logs);
  return result;
}

std::optional<std::size_t> doubtful_touch(const std::vector<Weighed>& all,
                                          const std::vector<bool>& may_be) {
  std::optional<std::size_t> doubtful;
  double best = -std::numeric_limits<double>::infinity();
  for (const Weighed& one : all) {
    if (one.change.kind == ChangeKind::kTouch) continue;
    const Eigen::MatrixXd information = one.how.foreseen.inverse();
    const Eigen::VectorXd pull = information * one.how.off_m;
    const double log_alone =
        one.how.log_evidence +
        std::log(one.change.weight / static_cast<double>(one.change.usual.size()));
    for (Eigen::Index t = 0; t < pull.size(); ++t) {
      if (!may_be[static_cast<std::size_t>(t)]) continue;
      // As (82), of a touch that is wrong by anything.
      const double log_pair =
          log_alone + 0.5 * (pull[t] * pull[t] / information(t, t) - std::log(information(t, t)));
      if (log_pair <= best) continue;
      best = log_pair;
      doubtful = static_cast<std::size_t>(t);
    }
  }
  return doubtful;
}

}  // namespace cellcal::calib
