#include "calib/estimate/budget.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "calib/estimate/region.h"
#include "calib/model/product.h"

namespace cellcal::calib {

namespace {

/// Sums of three rows each: the variance of each tip.
Eigen::VectorXd of_tips(const Eigen::VectorXd& coordinates) {
  return coordinates.reshaped(3, coordinates.size() / 3).colwise().sum().transpose();
}

double rms_sigma_m(const std::vector<Problem::Length>& lengths) {
  double square_m2 = 0.0, count = 0.0;
  for (const Problem::Length& length : lengths) {
    if (length.is_check) continue;
    square_m2 += length.sigma_m * length.sigma_m;
    ++count;
  }
  return count > 0.0 ? std::sqrt(square_m2 / count) : 0.0;
}

/// Touch noise of the covariance: as stated where the residuals are smaller.
double used_noise_m(const Calibration& c) {
  return c.chi2_per_dof > 0.0 ? c.touch_noise_m / std::sqrt(std::min(1.0, c.chi2_per_dof))
                              : c.touch_noise_m;
}

}  // namespace

UncertaintySource source_of(const ParameterKey& key) {
  if (is_positioner_compliance(key)) return UncertaintySource::kLoads;
  switch (key.kind) {
    case ParameterKind::kD:
    case ParameterKind::kA: return UncertaintySource::kArmLengths;
    case ParameterKind::kTheta:
    case ParameterKind::kAlpha:
    case ParameterKind::kBeta: return UncertaintySource::kArmAngles;
    case ParameterKind::kGuide: return UncertaintySource::kLinearUnit;
    case ParameterKind::kCosine:
    case ParameterKind::kSine:
    case ParameterKind::kFunctionCosine:
    case ParameterKind::kFunctionSine:
    case ParameterKind::kPlay: return UncertaintySource::kTransmission;
    case ParameterKind::kCompliance:
    case ParameterKind::kLoad:
    case ParameterKind::kBearing:
    case ParameterKind::kStiffening:
    case ParameterKind::kDeflection: return UncertaintySource::kLoads;
    case ParameterKind::kTcp: return UncertaintySource::kTool;
    case ParameterKind::kEffectiveRadius: return UncertaintySource::kEffectiveRadius;
    case ParameterKind::kLatchDelay: return UncertaintySource::kLatchDelay;
    case ParameterKind::kRadius: return UncertaintySource::kDiameters;
    case ParameterKind::kPositioner:
    case ParameterKind::kCentre:
    case ParameterKind::kTilt:
    case ParameterKind::kShift:
    case ParameterKind::kTurn:
    case ParameterKind::kProbeTurn: return UncertaintySource::kPlaces;
  }
  return UncertaintySource::kPlaces;
}

std::optional<double> prior_sigma_u(const Unknown& unknown, const LevelMean& levels) {
  if (!(unknown.prior_weight > 0.0)) return std::nullopt;
  const ParameterKind kind = unknown.key.kind;
  const double level = is_transmission(kind)          ? levels.transmission
                       : is_compliance(kind)          ? levels.compliance
                       : kind == ParameterKind::kPlay ? levels.play
                                                      : 1.0;
  return level / unknown.prior_weight;
}

UncertaintyBudget::UncertaintyBudget(const Problem& problem, const Estimate& e, double inflation,
                                     const Calibration& c)
    : problem_(problem),
      estimate_(e),
      inflation_(inflation),
      touch_noise_m_(used_noise_m(c)),
      ripple_rad_(c.level.ripple_rad),
      field_m_(c.discrepancy.sigma_m) {
  struct Sum {
    Priors group;
    double squares = 0.0;
    bool several_units = false;
  };
  std::map<UncertaintySource, Sum> sums;
  for (int i = 0; i < problem.size(); ++i) {
    const Unknown& unknown = problem.unknowns()[static_cast<std::size_t>(i)];
    const std::optional<double> sigma_u = prior_sigma_u(unknown, e.levels);
    if (!sigma_u || !(*sigma_u > 0.0)) continue;
    const UncertaintySource source = source_of(unknown.key);
    Sum& sum = sums[source];
    sum.group.line.source = source;
    sum.group.sigma_u.emplace_back(i, *sigma_u);
    sum.squares += std::pow(unknown.scale * *sigma_u, 2);
    sum.several_units = sum.several_units || unknown.unit != unit_of(source).name;
  }
  for (auto& [source, sum] : sums) {
    const double mean = sum.squares / static_cast<double>(sum.group.sigma_u.size());
    sum.group.line.sigma = sum.several_units ? 0.0 : std::sqrt(mean);
    priors_.push_back(std::move(sum.group));
  }
}

std::vector<UncertaintyLine> UncertaintyBudget::lines() const {
  std::vector<UncertaintyLine> all = {
      {UncertaintySource::kTouches, touch_noise_m_},
      {UncertaintySource::kCertifiedLengths, rms_sigma_m(problem_.lengths())}};
  for (const Priors& one : priors_) all.push_back(one.line);
  all.push_back({UncertaintySource::kRipple, ripple_rad_});
  all.push_back({UncertaintySource::kModel, field_m_});
  return all;
}

std::vector<double> UncertaintyBudget::contributions_m(const std::vector<JointVector>& poses,
                                                       const Eigen::MatrixXd& moves,
                                                       double standard_m) const {
  constexpr std::size_t kSample = 40;
  const std::vector<JointVector> sample(
      poses.begin(), poses.begin() + static_cast<std::ptrdiff_t>(std::min(kSample, poses.size())));
  const auto count = static_cast<Eigen::Index>(sample.size()), arm = moves.cols();
  const Eigen::MatrixXd at = moves.topRows(3 * count);
  // Motion of the tips by each unknown's information.
  const Eigen::MatrixXd reach = product(at, estimate_.posterior.covariance_u.topRows(arm));
  const Linearisation& linear = estimate_.posterior.linear;
  const auto by_rows = [&](const auto& rows) -> Eigen::VectorXd {
    return of_tips(product(reach, rows.transpose()).rowwise().squaredNorm());
  };
  std::vector<Eigen::VectorXd> variance_m2 = {by_rows(linear.jacobian.topRows(linear.length_row)),
                                              Eigen::VectorXd::Zero(count)};
  if (problem_.fitted_lengths() > 0)
    variance_m2.back() =
        by_rows(linear.jacobian.bottomRows(linear.jacobian.rows() - linear.length_row));
  for (const Priors& group : priors_) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(3 * count);
    for (const auto& [i, sigma_u] : group.sigma_u) sum += (reach.col(i) / sigma_u).cwiseAbs2();
    variance_m2.push_back(of_tips(sum));
  }
  Eigen::VectorXd parts = Eigen::VectorXd::Zero(count);
  for (const Eigen::VectorXd& one : variance_m2) parts += one;
  const Eigen::VectorXd by_parameters =
      inflation_ * of_tips(reach.leftCols(arm).cwiseProduct(at).rowwise().sum()).cwiseMax(0.0);
  for (Eigen::VectorXd& one : variance_m2)
    one = (parts.array() > 0.0).select(one.array() * by_parameters.array() / parts.array(), 0.0);
  variance_m2.push_back(ripple_variance_m2(problem_.arm(), sample, ripple_rad_));
  variance_m2.push_back(Eigen::VectorXd::Constant(count, 3.0 * field_m_ * field_m_));
  Eigen::VectorXd whole = Eigen::VectorXd::Zero(count);
  for (const Eigen::VectorXd& one : variance_m2) whole += one;
  const Eigen::ArrayXd root = whole.cwiseSqrt().array();
  std::vector<double> all;
  for (const Eigen::VectorXd& one : variance_m2) {
    // (40a)
    const Eigen::ArrayXd share = (root > 0.0).select(one.array() / root, 0.0);
    all.push_back(root.sum() > 0.0 ? standard_m * std::sqrt(share.sum() / root.sum()) : 0.0);
  }
  return all;
}

}  // namespace cellcal::calib
