#include "calib/update/weighed.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "calib/model/probability.h"
#include "calib/update/prior.h"

namespace cellcal::calib {

namespace {

/// Who asks for an update has a reason.
constexpr double kNothingBefore = 0.5;
/// Beforehand: of touches, those wrong by themselves though they were confirmed.
constexpr double kWrongTouch = 0.01;
/// Beforehand, in odds: where one thing changed, one time in ten another did as well.
constexpr double kSecondBefore = 0.1;

bool same(const PossibleChange& a, const PossibleChange& b) {
  return a.kind == b.kind && a.name == b.name && a.index == b.index;
}

Explanation explanation_of(const Weighed& one) {
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
  return normal_above(z);
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
    list.push_back(explanation_of(all[best]));
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

namespace {

/// Probability beforehand of this change at this size, natural logarithm.
double log_before(const Weighed& one) {
  return std::log(one.change.weight / static_cast<double>(one.change.usual.size()));
}

/// Another change beside the one that an explanation has.
struct Beside {
  Cholesky information;  ///< of its size
  Eigen::VectorXd size;
  double log_ratio = 0.0;  ///< of the touches with it over without, natural logarithm
};

/// Linearised where the first change has brought the arm. `off`: of the first one, whitened.
Beside beside(const Weighed& first, const Eigen::VectorXd& off, const Weighed& other) {
  Eigen::MatrixXd by = first.how.rows * other.moves;
  if (other.change.kind == ChangeKind::kTouch)
    by(static_cast<Eigen::Index>(other.change.index), 0) = -1.0;
  by = first.how.foreseen.whitened(by);
  const double variance = other.usual * other.usual;
  Eigen::MatrixXd information = by.transpose() * by;
  information.diagonal().array() += 1.0 / variance;
  const Eigen::VectorXd pull = by.transpose() * off;
  Beside result{Cholesky(information), {}, 0.0};
  result.size = result.information.solve(pull);
  result.log_ratio = 0.5 * (pull.dot(result.size) - result.information.log_det() -
                            static_cast<double>(other.change.size) * std::log(variance));  // (82)
  return result;
}

bool may_be_beside(const Weighed& other, const Weighed& first) {
  return other.change.size > 0 && !same(other.change, first.change);
}

}  // namespace

Sufficient sufficient(const Weighed& one, const std::vector<Weighed>& all,
                      std::size_t touches_set_aside) {
  Sufficient result;
  result.chi2 = one.how.chi2();
  result.degrees_of_freedom = static_cast<double>(one.how.off_m.size() - one.change.size) -
                              static_cast<double>(touches_set_aside);
  result.by_chance = chance_of(result.chi2, result.degrees_of_freedom);  // (81)
  const Eigen::VectorXd off = one.how.foreseen.whitened(one.how.off_m);
  std::vector<double> logs;
  double best = -std::numeric_limits<double>::infinity();
  for (const Weighed& other : all) {
    if (!may_be_beside(other, one)) continue;
    const Beside more = beside(one, off, other);
    logs.push_back(more.log_ratio + std::log(kSecondBefore) + log_before(other));
    if (logs.back() <= best) continue;
    best = logs.back();
    Weighed second{other.change, {}, other.usual, {}};
    second.how.size = more.size;
    second.how.size_covariance = more.information.inverse();
    result.second = explanation_of(second);
  }
  result.log_odds_more = log_sum(logs);
  return result;
}

OneOrTwo one_or_two(const std::vector<Weighed>& all) {
  std::vector<double> one, with_touch, two;
  for (const Weighed& first : all) {
    const double log_first = first.how.log_evidence + log_before(first);
    one.push_back(log_first);
    if (first.change.size == 0 || first.change.kind == ChangeKind::kTouch) continue;
    const Eigen::VectorXd off = first.how.foreseen.whitened(first.how.off_m);
    for (const Weighed& other : all) {
      if (!may_be_beside(other, first)) continue;
      const double log_pair = log_first + beside(first, off, other).log_ratio;
      if (other.change.kind == ChangeKind::kTouch)
        with_touch.push_back(
            log_pair + std::log(kWrongTouch / static_cast<double>(other.change.usual.size())));
      else
        two.push_back(log_pair + std::log(kSecondBefore) + log_before(other));
    }
  }
  return {log_sum(one), log_sum(with_touch), log_sum(two)};
}

double log_wrong(const std::vector<Weighed>& all, std::size_t touch) {
  const auto t = static_cast<Eigen::Index>(touch);
  const auto as_wrong = std::ranges::find_if(
      all, [](const Weighed& one) { return one.change.kind == ChangeKind::kTouch; });
  const std::vector<double>& usual = as_wrong->change.usual;
  std::vector<double> with, without;
  for (const Weighed& one : all) {
    if (one.change.kind == ChangeKind::kTouch) continue;
    // Given the other touches: how far this one is off, and how far chance would bring it.
    const Eigen::MatrixXd information = one.how.foreseen.inverse();
    const double variance = 1.0 / information(t, t);
    const double off = information.row(t).dot(one.how.off_m) * variance;
    const auto log_density = [&](double wide) {
      return -0.5 * (off * off / wide + std::log(wide));
    };
    without.push_back(one.how.log_evidence + log_before(one) - log_density(variance));
    for (const double size : usual)
      with.push_back(without.back() + log_density(variance + size * size) -
                     std::log(static_cast<double>(usual.size())));
  }
  return std::log(kWrongTouch) + log_sum(with) - log_sum(without);  // (85)
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
