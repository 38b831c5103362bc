#include "calib/estimate/budget.h"

#include <cmath>
#include <map>

#include "calib/estimate/region.h"

namespace cellcal::calib {

namespace {

UncertaintySource source_of(ParameterKind kind) {
  switch (kind) {
    case ParameterKind::kD:
    case ParameterKind::kA:
      return UncertaintySource::kArmLengths;
    case ParameterKind::kTheta:
    case ParameterKind::kAlpha:
    case ParameterKind::kBeta:
      return UncertaintySource::kArmAngles;
    case ParameterKind::kGuide:
      return UncertaintySource::kLinearUnit;
    case ParameterKind::kCosine:
    case ParameterKind::kSine:
    case ParameterKind::kFunctionCosine:
    case ParameterKind::kFunctionSine:
    case ParameterKind::kPlay:
      return UncertaintySource::kTransmission;
    case ParameterKind::kCompliance:
    case ParameterKind::kLoad:
    case ParameterKind::kBearing:
    case ParameterKind::kStiffening:
    case ParameterKind::kDeflection:
      return UncertaintySource::kLoads;
    case ParameterKind::kTcp:
      return UncertaintySource::kTool;
    case ParameterKind::kEffectiveRadius:
      return UncertaintySource::kEffectiveRadius;
    case ParameterKind::kLatchDelay:
      return UncertaintySource::kLatchDelay;
    case ParameterKind::kRadius:
      return UncertaintySource::kDiameters;
    case ParameterKind::kCentre:
    case ParameterKind::kTilt:
    case ParameterKind::kShift:
    case ParameterKind::kTurn:
    case ParameterKind::kProbeTurn:
      return UncertaintySource::kPlaces;
  }
  return UncertaintySource::kPlaces;
}

/// Variance summed over the coordinates of each tip.
Eigen::VectorXd variance_m2(const Eigen::MatrixXd& moves, const Eigen::MatrixXd& covariance_u) {
  const Eigen::VectorXd each = (moves * covariance_u).cwiseProduct(moves).rowwise().sum();
  return each.reshaped(3, each.size() / 3).colwise().sum().cwiseMax(0.0).transpose();
}

}  // namespace

UncertaintyBudget::UncertaintyBudget(const Problem& problem, const Estimate& e, double inflation,
                                     const Calibration& c)
    : arm_(problem.arm()),
      covariance_u_(inflation * e.posterior.covariance_u.topLeftCorner(arm_.size(), arm_.size())),
      ripple_rad_(c.level.ripple_rad),
      field_m_(c.discrepancy.sigma_m) {
  const Eigen::MatrixXd reach = e.posterior.covariance_u.topRows(arm_.size());
  add_touches(e.posterior.linear, reach, c.touch_noise_m);
  add_lengths(problem, e.posterior.linear, reach);
  add_priors(problem, reach);
}

void UncertaintyBudget::add_touches(const Linearisation& linear, const Eigen::MatrixXd& reach,
                                    double sigma_m) {
  const Eigen::MatrixXd by_row = reach * linear.jacobian.topRows(linear.length_row).transpose();
  parts_.push_back({{UncertaintySource::kTouches, sigma_m}, by_row * by_row.transpose()});
}

void UncertaintyBudget::add_lengths(const Problem& problem, const Linearisation& linear,
                                    const Eigen::MatrixXd& reach) {
  const int fitted = problem.fitted_lengths();
  if (fitted == 0) return;
  const Eigen::Index count = linear.jacobian.rows() - linear.length_row;
  const Eigen::MatrixXd by_row = reach * linear.jacobian.bottomRows(count).transpose();
  double square_m2 = 0.0;
  for (const Problem::Length& length : problem.lengths())
    if (!length.is_check) square_m2 += length.sigma_m * length.sigma_m;
  parts_.push_back(
      {{UncertaintySource::kLengths, std::sqrt(square_m2 / fitted)}, by_row * by_row.transpose()});
}

void UncertaintyBudget::add_priors(const Problem& problem, const Eigen::MatrixXd& reach) {
  struct Group {
    std::vector<int> unknowns;
    double square = 0.0;
    bool mixed = false;
  };
  std::map<UncertaintySource, Group> groups;
  for (int i = 0; i < problem.size(); ++i) {
    const Unknown& unknown = problem.unknowns()[static_cast<std::size_t>(i)];
    if (!(unknown.prior_weight > 0.0)) continue;
    Group& group = groups[source_of(unknown.key.kind)];
    group.mixed = group.mixed || unknown.unit != unit_of(source_of(unknown.key.kind)).name;
    group.square += std::pow(unknown.scale / unknown.prior_weight, 2);
    group.unknowns.push_back(i);
  }
  for (const auto& [source, group] : groups) {
    Eigen::MatrixXd by_row(reach.rows(), static_cast<Eigen::Index>(group.unknowns.size()));
    for (Eigen::Index k = 0; k < by_row.cols(); ++k) {
      const int i = group.unknowns[static_cast<std::size_t>(k)];
      by_row.col(k) = reach.col(i) * problem.unknowns()[static_cast<std::size_t>(i)].prior_weight;
    }
    const double sigma = std::sqrt(group.square / static_cast<double>(group.unknowns.size()));
    parts_.push_back({{source, group.mixed ? 0.0 : sigma}, by_row * by_row.transpose()});
  }
}

std::vector<UncertaintyLine> UncertaintyBudget::lines() const {
  std::vector<UncertaintyLine> all;
  for (const Part& part : parts_) all.push_back(part.line);
  all.push_back({UncertaintySource::kRipple, ripple_rad_});
  all.push_back({UncertaintySource::kModel, field_m_});
  return all;
}

std::vector<double> UncertaintyBudget::contributions_m(const std::vector<JointVector>& poses,
                                                       const Eigen::MatrixXd& moves) const {
  std::vector<Eigen::VectorXd> variance;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(moves.rows() / 3);
  for (const Part& part : parts_) {
    variance.push_back(variance_m2(moves, part.covariance_u));
    sum += variance.back();
  }
  const Eigen::VectorXd by_parameters = variance_m2(moves, covariance_u_);
  for (Eigen::VectorXd& one : variance)
    one = (sum.array() > 0.0).select(one.array() * by_parameters.array() / sum.array(), 0.0);
  variance.push_back(ripple_variance_m2(arm_, poses, ripple_rad_));
  variance.push_back(Eigen::VectorXd::Constant(sum.size(), 3.0 * field_m_ * field_m_));
  Eigen::VectorXd whole = Eigen::VectorXd::Zero(sum.size());
  for (const Eigen::VectorXd& one : variance) whole += one;
  const Eigen::VectorXd standard_m = whole.cwiseSqrt();
  std::vector<double> all;
  for (const Eigen::VectorXd& one : variance) {
    const Eigen::ArrayXd share =
        (whole.array() > 0.0).select(one.array() / standard_m.array(), 0.0);
    // (40a)
    all.push_back(std::sqrt(standard_m.mean() * share.mean()));
  }
  return all;
}

}  // namespace cellcal::calib
