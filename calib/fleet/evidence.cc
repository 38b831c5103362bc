#include "calib/fleet/evidence.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "calib/files/nominal_geometry.h"
#include "calib/linear/eigenpairs.h"
#include "calib/model/kinematics.h"
#include "calib/result/level.h"

namespace cellcal::calib {

namespace {

/// A direction of which the touches took less than a fiftieth of the prior's variance away tells next to nothing,
/// and what moments of a mean over levels got wrong would count by the root of fifty.
constexpr double kDecidedByPrior = 0.98;
/// More than beforehand nobody can be unsure; some is what the moments of a mean over levels leave.
constexpr double kMostOfPrior = 2.0;
/// Finer than a hundred-thousandth of a tolerance is beyond all touching.
constexpr double kLeastOfPrior = 1e-10;

/// rms over the levels that the touches left, of those that were considered.
double rms_size(const Calibration& c, double ModelLevel::*size) {
  double sum = 0.0, weight = 0.0;
  for (const LevelEvidence& one : c.levels) {
    const double p = std::clamp(one.probability, 0.0, 1.0);
    sum += p * std::pow(one.level.*size, 2);
    weight += p;
  }
  return weight > 0.0 ? std::sqrt(sum / weight) : c.level.*size;
}

/// Prior sigmas of what is learned.
std::map<ParameterKey, double> prior_sigmas(const Calibration& c) {
  const double compliance = rms_size(c, &ModelLevel::compliance),
               transmission = rms_size(c, &ModelLevel::transmission);
  const ArmModel arm(at_level(c.cell, {}));
  const bool stated = std::ranges::any_of(
      c.cell.robot.joints, [](const Joint& j) { return j.compliance_sigma_rad_per_nm > 0.0; });
  std::map<ParameterKey, double> sigmas;
  for (const ArmParameter& p : arm.parameters()) {
    if (is_geometric(p.kind)) sigmas[p] = p.sigma;
    if (is_transmission(p.kind)) sigmas[p] = p.sigma * transmission;
    if (p.kind == ParameterKind::kCompliance && stated) sigmas[p] = p.sigma * compliance;
  }
  return sigmas;
}

bool is_whole(const Calibration& c) {
  const auto n = static_cast<Eigen::Index>(c.parameters.size());
  return n > 0 && c.covariance.rows() == n && c.covariance.cols() == n &&
         c.covariance.allFinite() && std::isfinite(c.chi2_per_dof);
}

/// (87)
std::optional<SetAsideKind> divide_out(const Eigen::VectorXd& mean,
                                       const Eigen::MatrixXd& covariance,
                                       const Eigen::VectorXd& sigma, double widened,
                                       ArmEvidence& evidence) {
  const Eigen::VectorXd per_sigma = sigma.cwiseInverse();
  const auto pairs = eigenpairs(per_sigma.asDiagonal() * covariance * per_sigma.asDiagonal());
  const Eigen::Index n = sigma.size();
  if (!pairs.values.allFinite() || pairs.values[n - 1] > kMostOfPrior)
    return SetAsideKind::kInconsistent;
  Eigen::Index determined = 0;
  while (determined < n && pairs.values[determined] < kDecidedByPrior) ++determined;
  if (determined == 0) return SetAsideKind::kTellsNothing;
  evidence.rows.resize(determined, n);
  evidence.values.resize(determined);
  for (Eigen::Index i = 0; i < determined; ++i) {
    const double left = std::max(pairs.values[i], kLeastOfPrior);
    const double size = std::sqrt((1.0 / left - 1.0) / widened);
    evidence.rows.row(i) = size * pairs.vectors.col(i).cwiseProduct(per_sigma).transpose();
    evidence.values[i] =
        pairs.vectors.col(i).dot(per_sigma.cwiseProduct(mean)) / (left * widened * size);
  }
  if (!evidence.rows.allFinite() || !evidence.values.allFinite())
    return SetAsideKind::kInconsistent;
  return std::nullopt;
}

}  // namespace

std::variant<ArmEvidence, SetAsideKind> evidence_of(const Calibration& c) {
  if (!c.verdict.publish) return SetAsideKind::kWithheld;
  if (!is_whole(c)) return SetAsideKind::kInconsistent;
  const auto sigmas = prior_sigmas(c);
  ArmEvidence evidence;
  evidence.update = c.update.has_value();
  evidence.robot = c.cell.robot;
  evidence.nominal_geometry = nominal_geometry_sha256(c.cell.robot);
  std::vector<Eigen::Index> at;
  std::vector<double> sigma, mean;
  for (std::size_t i = 0; i < c.parameters.size(); ++i) {
    const ParameterResult& p = c.parameters[i];
    const auto found = sigmas.find(p.key);
    if (found == sigmas.end() && is_geometric(p.key.kind)) return SetAsideKind::kInconsistent;
    if (found == sigmas.end() || !(found->second > 0.0)) continue;
    at.push_back(static_cast<Eigen::Index>(i));
    evidence.keys.push_back(p.key);
    sigma.push_back(found->second);
    mean.push_back(p.correction);
  }
  if (at.empty()) return SetAsideKind::kTellsNothing;
  // Of an update the last calibration's covariance is in it as that stated it.
  const double widened = evidence.update ? 1.0 : std::max(1.0, c.chi2_per_dof);
  const auto n = static_cast<Eigen::Index>(at.size());
  const auto as_vector = [n](const std::vector<double>& v) -> Eigen::VectorXd {
    return Eigen::Map<const Eigen::VectorXd>(v.data(), n);
  };
  if (const auto wrong = divide_out(as_vector(mean), c.covariance(at, at) / widened,
                                    as_vector(sigma), widened, evidence))
    return *wrong;
  return evidence;
}

}  // namespace cellcal::calib
