#include "calib/update/explained.h"

#include <algorithm>
#include <optional>

namespace cellcal::calib {

namespace {

std::optional<Eigen::Index> row_of(const Calibration& c, const ParameterKey& key) {
  const auto found = std::ranges::find(c.parameters, key, &ParameterResult::key);
  if (found == c.parameters.end()) return std::nullopt;
  return found - c.parameters.begin();
}

}  // namespace

TouchEquations::TouchEquations(const Calibration& prior, const std::vector<Touch>& touches)
    : known_(prior, touches), parameters_(static_cast<Eigen::Index>(prior.parameters.size())) {
  const Foresight foresight = foresee(prior, touches);
  contacts_ = foresight.contacts;
  noise_m2_ = foresight.beside_m2 + foresight.passing_m2;
  std::vector<double> values, variances;
  for (const ParameterResult& one : prior.parameters)
    values.push_back(one.nominal + one.correction);
  for (const Unknown& unknown : known_.unknowns()) {
    const auto place = row_of(prior, unknown.key);
    const bool asked = !place && unknown.key.kind == ParameterKind::kLatchDelay;
    place_.push_back(place ? *place : asked ? static_cast<Eigen::Index>(values.size()) : -1);
    if (!asked) continue;
    values.push_back(unknown.nominal);
    variances.push_back(unknown.scale * unknown.scale);
  }
  const auto all = static_cast<Eigen::Index>(values.size());
  x_ = Eigen::Map<const Eigen::VectorXd>(values.data(), all);
  covariance_ = Eigen::MatrixXd::Zero(all, all);
  covariance_.topLeftCorner(parameters_, parameters_) = prior.covariance;
  for (std::size_t k = 0; k < variances.size(); ++k) {
    const Eigen::Index at = parameters_ + static_cast<Eigen::Index>(k);
    covariance_(at, at) = variances[k];
  }
}

void TouchEquations::set_aside(std::size_t touch) {
  constexpr double kAnywhereM = 1.0;
  const auto k = static_cast<Eigen::Index>(touch);
  noise_m2_.row(k).setZero();
  noise_m2_.col(k).setZero();
  noise_m2_(k, k) = kAnywhereM * kAnywhereM;
}

Eigen::VectorXd TouchEquations::in_problem(const Eigen::VectorXd& x) const {
  Eigen::VectorXd of_problem = known_.x();
  for (std::size_t i = 0; i < place_.size(); ++i)
    if (place_[i] >= 0) of_problem[static_cast<Eigen::Index>(i)] = x[place_[i]];
  return of_problem;
}

Eigen::VectorXd TouchEquations::off_m(const Eigen::VectorXd& x) const {
  return known_.off_m(in_problem(x));
}

Eigen::MatrixXd TouchEquations::rows(const Eigen::VectorXd& x) const {
  const KnownTouches::RowMajor of_problem = known_.rows(in_problem(x));
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(of_problem.rows(), x_.size());
  for (std::size_t i = 0; i < place_.size(); ++i)
    if (place_[i] >= 0) rows.col(place_[i]) = of_problem.col(static_cast<Eigen::Index>(i));
  return rows;
}

Eigen::MatrixXd Explained::covariance(const Eigen::MatrixXd& beforehand) const {
  const Eigen::MatrixXd whitened = foreseen.whitened(Eigen::MatrixXd(across_m.transpose()));
  return beforehand - whitened.transpose() * whitened;  // (79)
}

Explained explained(const TouchEquations& touches, const PossibleChange& change,
                    const Eigen::MatrixXd& moves, double usual) {
  // Of a shift of millimetres against a sphere of some ten each step leaves a tenth or less.
  constexpr int kSteps = 12;
  constexpr double kSettledM = 1e-9;
  Explained e;
  e.x = touches.x();
  const double variance = usual * usual;
  Eigen::MatrixXd by_size;
  for (int k = 0; k < kSteps; ++k) {
    e.rows = touches.rows(e.x);
    by_size = e.rows * moves;
    if (change.kind == ChangeKind::kTouch)
      by_size(static_cast<Eigen::Index>(change.index), 0) = -1.0;
    e.off_m = e.rows * (e.x - touches.x()) - touches.off_m(e.x);  // (77)
    const Eigen::MatrixXd through = touches.covariance() * e.rows.transpose();
    Eigen::MatrixXd v =
        e.rows * through + touches.noise_m2() + variance * by_size * by_size.transpose();
    v = (0.5 * (v + v.transpose())).eval();
    e.foreseen = Cholesky(v);  // (76)
    e.across_m = through + variance * moves * by_size.transpose();
    const Eigen::VectorXd next = touches.x() + e.across_m * e.foreseen.solve(e.off_m);  // (78)
    const double step_m = (e.rows * (next - e.x)).cwiseAbs().maxCoeff();
    e.x = next;
    if (step_m < kSettledM) break;
  }
  const Eigen::MatrixXd whitened = e.foreseen.whitened(by_size);
  e.size = variance * whitened.transpose() * e.foreseen.whitened(e.off_m);
  e.size_covariance = variance * Eigen::MatrixXd::Identity(change.size, change.size) -
                      variance * variance * whitened.transpose() * whitened;
  e.log_evidence = -0.5 * (e.chi2() + e.foreseen.log_det());
  return e;
}

}  // namespace cellcal::calib
