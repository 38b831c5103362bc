#include "calib/check/explain.h"

#include <algorithm>
#include <cmath>

#include "calib/model/probability.h"

namespace cellcal::calib {

namespace {

/// A sensor that sees nothing though there is a contact, of those that proved themselves behind it.
constexpr double kBlind = 1e-6;

/// That the search ends outside of the surface.
double log_unmet_under(const Unmet& unmet, const PossibleChange& change, const Fitted& fitted) {
  if (change.kind == ChangeKind::kTouch) return std::log(kBlind);  // that of another touch
  const Changed at = changed(change, fitted.size, {unmet.at_end});
  const double gap = at.off_m[0];
  const double variance = unmet.sigma_m * unmet.sigma_m +
                          (at.by_size * fitted.covariance * at.by_size.transpose())(0, 0);
  return std::log(kBlind + (1.0 - kBlind) * normal_above(-gap / std::sqrt(variance)));
}

}  // namespace

Fitted fit(const PossibleChange& change, double usual, const std::vector<ForeseenContact>& contacts,
           const Cholesky& covariance) {
  const double prior = 1.0 / (usual * usual);
  Fitted fitted{Eigen::VectorXd::Zero(change.size), {}, 0.0};
  Eigen::VectorXd off;
  Eigen::MatrixXd by, information;
  const auto look = [&](const Eigen::VectorXd& size) {
    const Changed at = changed(change, size, contacts);
    off = covariance.whitened(at.off_m);
    by = covariance.whitened(at.by_size);
    return off.squaredNorm() + prior * size.squaredNorm();
  };
  const double nothing = look(fitted.size);
  double least = nothing;
  // Gauss-Newton: of a shift of millimetres against a sphere of some ten, each leaves a tenth or less.
  constexpr int kSteps = 12, kHalvings = 6;
  // Of a sum of squares whose differences are judged by whole numbers.
  constexpr double kSettled = 1e-6;
  for (int k = 0; k < kSteps; ++k) {
    information = by.transpose() * by;
    information.diagonal().array() += prior;
    const Eigen::VectorXd pull = -(by.transpose() * off + prior * fitted.size);
    Eigen::VectorXd step = pivoted_solve(information, pull);
    if (pull.dot(step) < kSettled) break;  // what it would bring
    double reached = look(fitted.size + step);
    for (int h = 0; h < kHalvings && !(reached < least); ++h) {
      step /= 2.0;
      reached = look(fitted.size + step);
    }
    if (!(reached < least)) break;
    fitted.size += step;
    least = reached;
  }
  const Cholesky factor(information);
  fitted.covariance = factor.inverse();
  fitted.log_likelihood =  // (95)
      0.5 * (nothing - least - factor.log_det() - change.size * std::log(usual * usual));
  return fitted;
}

Explanation explain(const PossibleChange& change, const std::vector<ForeseenContact>& contacts,
                    const Cholesky& covariance, const std::vector<Unmet>& unmet) {
  Explanation explanation;
  explanation.kind = change.kind;
  explanation.name = change.name;
  explanation.touch = change.kind == ChangeKind::kTouch ? change.index : 0;
  Fitted best;
  std::vector<double> logs;
  for (const double usual : change.usual) {
    Fitted one = fit(change, usual, contacts, covariance);
    for (const Unmet& touch : unmet) one.log_likelihood += log_unmet_under(touch, change, one);
    logs.push_back(one.log_likelihood);
    if (logs.size() == 1 || one.log_likelihood > best.log_likelihood) best = std::move(one);
  }
  double sum = 0.0;
  for (const double one : logs) sum += std::exp(one - best.log_likelihood);
  explanation.log_likelihood =
      best.log_likelihood + std::log(sum / static_cast<double>(logs.size()));
  if (change.size == 1) {
    explanation.amount = best.size[0];
    explanation.sigma = std::sqrt(best.covariance(0, 0));
    return explanation;
  }
  explanation.shift_m = best.size;
  const double length = best.size.norm();
  const Eigen::Vector3d along = length > 0.0 ? Eigen::Vector3d(best.size / length)
                                             : Eigen::Vector3d(Eigen::Vector3d::UnitX());
  explanation.sigma = std::sqrt(along.dot(best.covariance * along));
  return explanation;
}

double log_unmet(const std::vector<Unmet>& unmet) {
  return static_cast<double>(unmet.size()) * std::log(kBlind);
}

}  // namespace cellcal::calib
