#include "calib/priors/learn.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "calib/files/cell_file.h"
#include "calib/files/robot_file.h"
#include "calib/model/enum_table.h"
#include "calib/model/kinematics.h"
#include "calib/model/linear.h"
#include "calib/model/units.h"
#include "calib/priors/spreads.h"
#include "calib/result/level.h"

namespace cellcal::calib {

namespace {

constexpr double kMostOutliers = 0.2;
/// Smaller functions are none.
constexpr double kLeastFunctionRad = 0.5 * kRadPerArcsec;

std::optional<SpreadKind> kind_of(const ParameterKey& key) {
  switch (key.kind) {
    case ParameterKind::kD:
    case ParameterKind::kA: return SpreadKind::kLength;
    case ParameterKind::kTheta:
    case ParameterKind::kAlpha:
    case ParameterKind::kBeta: return SpreadKind::kAngle;
    case ParameterKind::kCompliance: return SpreadKind::kCompliance;
    case ParameterKind::kCosine:
    case ParameterKind::kSine: return SpreadKind::kGear;
    default: return std::nullopt;
  }
}

/// The errors of a nominal geometry with their stated sigmas, in groups of one spread.
struct Drawn {
  explicit Drawn(const Robot& robot) : name(robot.name) {
    Cell cell;
    cell.robot = robot;
    const bool compliance = std::ranges::any_of(
        robot.joints, [](const Joint& j) { return j.compliance_sigma_rad_per_nm > 0.0; });
    const ArmModel arm(at_level(cell, {}));
    std::map<std::pair<int, SpreadKind>, Eigen::Index> places;
    for (const ArmParameter& p : arm.parameters()) {
      const auto kind = kind_of(p);
      if (!kind || (*kind == SpreadKind::kCompliance && !compliance)) continue;
      const auto [place, is_new] = places.try_emplace({p.joint, *kind}, groups.size());
      if (is_new) {
        groups.kind.push_back(static_cast<int>(*kind));
        joint.push_back(static_cast<std::size_t>(p.joint));
        // Gears: amplitude of order 1.
        stated.push_back(*kind == SpreadKind::kGear
                             ? arm.robot().joints[joint.back()].harmonic_sigma_rad
                             : p.sigma);
      }
      column[p] = groups.errors();
      groups.of_error.push_back(place->second);
      sigma.push_back(p.sigma);
    }
  }

  /// In units of these sigmas; errors without one here are marginalised.
  ArmRows rows_of(const ArmEvidence& arm) const {
    ArmRows result{Eigen::MatrixXd::Zero(arm.rows.rows(), groups.errors()), arm.values};
    for (std::size_t k = 0; k < arm.keys.size(); ++k)
      if (const auto found = column.find(arm.keys[k]); found != column.end())
        result.rows.col(found->second) = arm.rows.col(static_cast<Eigen::Index>(k)) *
                                         sigma[static_cast<std::size_t>(found->second)];
    return result;
  }

  std::string name;
  Groups groups;
  std::vector<std::size_t> joint;  ///< per group
  std::vector<double> stated;      ///< per group
  std::vector<double> sigma;       ///< per error
  std::map<ParameterKey, Eigen::Index> column;
};

/// Makes the result independent of the input order; calibrations of one arm are sorted best first.
void sort_by_evidence(std::vector<ArmEvidence>& arms) {
  std::ranges::sort(arms, [](const ArmEvidence& a, const ArmEvidence& b) {
    return std::tie(a.arm, a.update, b.time, a.name, a.values[0]) <
           std::tie(b.arm, b.update, a.time, b.name, b.values[0]);
  });
}

/// Keeps the first calibration of each arm known by name.
void drop_duplicates(std::vector<ArmEvidence>& arms, std::vector<SetAside>& set_aside) {
  std::vector<ArmEvidence> kept;
  for (ArmEvidence& arm : arms) {
    if (!arm.arm.empty() && !kept.empty() && kept.back().arm == arm.arm)
      set_aside.push_back({arm.name, SetAsideKind::kSameArm, kept.back().name});
    else
      kept.push_back(std::move(arm));
  }
  arms = std::move(kept);
}

void keep_nominal_geometry(const std::string& wanted, std::vector<ArmEvidence>& arms,
                           std::vector<SetAside>& set_aside) {
  std::erase_if(arms, [&](const ArmEvidence& arm) {
    if (arm.nominal_geometry == wanted) return false;
    set_aside.push_back({arm.name, SetAsideKind::kOtherNominalGeometry});
    return true;
  });
}

/// Returns the number of arms that are too far or too near.
int report_set_aside(const std::vector<ArmEvidence>& arms, const Population& p,
                     std::vector<SetAside>& set_aside) {
  int outliers = 0;
  for (std::size_t k = 0; k < arms.size(); ++k) {
    if (p.use[k]) continue;
    SetAside one{arms[k].name, SetAsideKind::kSameArm};
    if (p.same_as[k] != k) {
      one.other = arms[p.same_as[k]].name;
    } else {
      ++outliers;
      one.chi2 = p.chi2[k];
      one.directions = static_cast<int>(arms[k].values.size());
      one.kind = p.far[k] > 0.0 ? SetAsideKind::kTooFar : SetAsideKind::kTooNear;
    }
    set_aside.push_back(std::move(one));
  }
  return outliers;
}

std::vector<JointPriors> joints_of(const Drawn& drawn, const Robot& robot, const SpreadFit& fit) {
  std::vector<JointPriors> joints;
  for (const Joint& joint : robot.joints) joints.push_back({joint.name, {}, 0.0});
  for (Eigen::Index g = 0; g < drawn.groups.size(); ++g) {
    const auto k = static_cast<std::size_t>(g);
    const double found = drawn.stated[k] * std::exp(fit.mode[g]);
    joints[drawn.joint[k]].of(static_cast<SpreadKind>(drawn.groups.kind[k])) =
        Spread{drawn.stated[k], found, found * fit.sigma[g], fit.arms[g]};
  }
  return joints;
}

/// Prior size, which counts for one arm.
constexpr double kUsualFunctionRad = 15.0 * kRadPerArcsec;
/// A larger size of one arm is taken for this many times the arms' median.
constexpr double kMostOfMedian = 3.0;

/// The functions' sizes and reaches over the arms in use; none unless half of the arms have
/// functions.
void learn_functions(const std::vector<ArmEvidence>& arms, const std::vector<bool>& use,
                     std::vector<JointPriors>& joints) {
  for (std::size_t j = 0; j < joints.size(); ++j) {
    std::vector<double> sizes, reaches;
    for (std::size_t k = 0; k < arms.size(); ++k) {
      if (!use[k] || j >= arms[k].functions.size()) continue;
      const FunctionSize& one = arms[k].functions[j];
      sizes.push_back(std::max(one.size_rad, kLeastFunctionRad));
      if (one.reach_rad > 0.0) reaches.push_back(one.reach_rad);
    }
    const auto n = static_cast<double>(sizes.size());
    if (static_cast<double>(reaches.size()) < std::max<double>(kFewestArms, n / 2.0)) continue;
    const Eigen::ArrayXd size =
        Eigen::Map<const Eigen::ArrayXd>(sizes.data(), static_cast<Eigen::Index>(sizes.size()))
            .min(kMostOfMedian * median(sizes));
    const Eigen::ArrayXd logs = size.log();
    const double scatter = std::sqrt((logs - logs.mean()).square().sum() / (n - 1.0) / n);
    const double found =
        std::sqrt((size.square().sum() + kUsualFunctionRad * kUsualFunctionRad) / (n + 1.0));
    joints[j].of(SpreadKind::kFunction) =
        Spread{kUsualFunctionRad, found, found * std::max(scatter, 1.0 / std::sqrt(2.0 * n)), n};
    joints[j].function_reach_rad = median(std::move(reaches));
  }
}

double tolerances(const Robot& robot) {
  double sum = 0.0;
  for (const Joint& j : robot.joints) sum += j.tolerance_length_m + j.tolerance_angle_rad;
  return sum;
}

/// The joint's field for a prior of this kind.
double Joint::*place_of(SpreadKind kind) {
  using enum SpreadKind;
  static constexpr EnumTable<SpreadKind, double Joint::*> kTable{
      {{kLength, &Joint::tolerance_length_m},
       {kAngle, &Joint::tolerance_angle_rad},
       {kCompliance, &Joint::compliance_sigma_rad_per_nm},
       {kGear, &Joint::harmonic_sigma_rad},
       {kFunction, &Joint::function_sigma_rad}}};
  return kTable[kind];
}

/// Sets the gear orders assumed by an estimate if the file names none.
void set_default_orders(Robot& robot) {
  Cell cell;
  cell.robot = robot;
  const Robot assumed = at_level(cell, {}).robot;
  for (std::size_t i = 0; i < robot.joints.size(); ++i) {
    Joint& joint = robot.joints[i];
    joint.harmonics = assumed.joints[i].harmonics;
    joint.harmonic_falloff = assumed.joints[i].harmonic_falloff;
    joint.gear_ratio = assumed.joints[i].gear_ratio;
    joint.harmonic_sigma_rad = assumed.joints[i].harmonic_sigma_rad;
  }
}

/// A direction in which the touches reduce the prior variance by less than a fiftieth carries almost no
/// information, and the error of the moments of a mean over levels would be amplified by the root of fifty.
constexpr double kDecidedByPrior = 0.98;
/// Posterior variance above the prior's is an artefact of the moments of a mean over levels;
/// tolerated up to this factor.
constexpr double kMostOfPrior = 2.0;
/// Variance ratios below a hundred-thousandth of a tolerance are not plausible.
constexpr double kLeastOfPrior = 1e-10;

/// rms over the levels considered, weighted by probability.
double rms_size(const Calibration& c, double ModelLevel::*size) {
  double sum = 0.0, weight = 0.0;
  for (const LevelEvidence& one : c.levels) {
    const double p = std::clamp(one.probability, 0.0, 1.0);
    sum += p * std::pow(one.level.*size, 2);
    weight += p;
  }
  return weight > 0.0 ? std::sqrt(sum / weight) : c.level.*size;
}

/// Prior sigmas of the parameters that are learned.
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

/// MacKay's fixed point of the size, from the coefficients that the touches determined.
/// `widened`: factor on the covariance.
std::vector<FunctionSize> function_sizes(const Calibration& c, double widened) {
  std::vector<FunctionSize> all;
  const ArmModel arm(at_level(c.cell, {}));
  for (std::size_t j = 0; j < c.cell.robot.joints.size(); ++j) {
    double square = 0.0, determined = 0.0;
    for (const ArmParameter& p : arm.parameters()) {
      const ParameterResult* result = find(c, p);
      if (!is_function(p.kind) || p.joint != static_cast<int>(j) || result == nullptr) continue;
      square += std::pow(result->correction / p.sigma, 2);
      determined += std::max(0.0, 1.0 - std::pow(result->sigma / p.sigma, 2) / widened);
    }
    const Joint& joint = c.cell.robot.joints[j];
    constexpr double kEnough = 4.0;
    const double shown = std::sqrt(square / std::max(determined, 1.0));
    all.push_back(determined < kEnough || !(joint.function_sigma_rad > 0.0)
                      ? FunctionSize{c.level.ripple_rad, 0.0}
                      : FunctionSize{joint.function_sigma_rad * shown, joint.function_reach_rad});
  }
  return all;
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
  if (determined == 0) return SetAsideKind::kUninformative;
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

Robot commonest_nominal_geometry(const std::vector<ArmEvidence>& arms) {
  if (arms.empty()) throw std::invalid_argument("no arms, no nominal geometry");
  std::map<std::string, int> counts;
  for (const ArmEvidence& arm : arms) ++counts[arm.nominal_geometry];
  const auto most = std::ranges::max_element(counts, {}, [](const auto& c) { return c.second; });
  std::vector<const Robot*> robots;
  for (const ArmEvidence& arm : arms)
    if (arm.nominal_geometry == most->first) robots.push_back(&arm.robot);
  std::ranges::sort(robots, {},
                    [](const Robot* r) { return std::pair(tolerances(*r), robot_to_toml(*r)); });
  return *robots[robots.size() / 2];
}

Learned learn(const Robot& nominal, std::vector<ArmEvidence> arms) {
  Learned learned;
  FleetPriors& priors = learned.priors;
  priors.robot = nominal.name;
  priors.nominal_geometry = nominal_geometry_sha256(nominal);
  keep_nominal_geometry(priors.nominal_geometry, arms, learned.set_aside);
  sort_by_evidence(arms);
  drop_duplicates(arms, learned.set_aside);
  priors.arms = static_cast<int>(arms.size());
  if (priors.arms < kFewestArms) {
    learned.none = NoPriors::kTooFewArms;
  } else {
    const Drawn drawn(nominal);
    std::vector<ArmRows> rows;
    for (const ArmEvidence& arm : arms) rows.push_back(drawn.rows_of(arm));
    const Population p = population_of(rows, drawn.groups);
    const int outliers = report_set_aside(arms, p, learned.set_aside);
    priors.arms = static_cast<int>(std::ranges::count(p.use, true));
    if (outliers > kMostOutliers * (priors.arms + outliers))
      learned.none = NoPriors::kNotOnePopulation;
    else if (priors.arms < kFewestArms)
      learned.none = NoPriors::kTooFewArms;
    else
      priors.joints = joints_of(drawn, nominal, p.spreads);
    learn_functions(arms, p.use, priors.joints);  // of no joints without priors
  }
  std::ranges::sort(learned.set_aside, {},
                    [](const SetAside& one) { return std::tie(one.name, one.kind, one.other); });
  return learned;
}

std::variant<ArmEvidence, SetAsideKind> evidence_of(const Calibration& c) {
  if (!c.verdict.publish()) return SetAsideKind::kWithheld;
  // Priors are learnt for arms; external axes are part of the installation.
  if (c.cell.robot.first_turning() > 0 || !c.cell.robot.positioner.empty())
    return SetAsideKind::kOtherNominalGeometry;
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
  if (at.empty()) return SetAsideKind::kUninformative;
  // In an update the last calibration's covariance enters as it was stated.
  const double widened = evidence.update ? 1.0 : std::max(1.0, c.chi2_per_dof);
  evidence.functions = function_sizes(c, widened);
  const auto n = static_cast<Eigen::Index>(at.size());
  const auto as_vector = [n](const std::vector<double>& v) -> Eigen::VectorXd {
    return Eigen::Map<const Eigen::VectorXd>(v.data(), n);
  };
  if (const auto wrong = divide_out(as_vector(mean), c.covariance(at, at) / widened,
                                    as_vector(sigma), widened, evidence))
    return *wrong;
  return evidence;
}

std::variant<Accepted, OtherNominalGeometry> accept(const Robot& robot, const FleetPriors& priors) {
  if (const std::string own = nominal_geometry_sha256(robot); own != priors.nominal_geometry)
    return OtherNominalGeometry{priors.nominal_geometry, own};
  Accepted accepted{robot, {}};
  const bool gears_named =
      std::ranges::any_of(robot.joints, [](const Joint& j) { return j.harmonic_sigma_rad > 0.0; });
  const bool gears_learned = std::ranges::any_of(
      priors.joints, [](const JointPriors& j) { return j.of(SpreadKind::kGear).has_value(); });
  if (!gears_named && gears_learned) set_default_orders(accepted.robot);
  for (const JointPriors& prior : priors.joints) {
    const auto at = std::ranges::find(accepted.robot.joints, prior.joint, &Joint::name);
    if (at == accepted.robot.joints.end()) continue;
    const Joint& old = robot.joints[static_cast<std::size_t>(at - accepted.robot.joints.begin())];
    for (const SpreadKind kind : kSpreadKinds) {
      const auto& spread = prior.of(kind);
      double& value = (*at).*place_of(kind);
      if (!spread || !(value > 0.0 || kind == SpreadKind::kFunction)) continue;
      value = offered(*spread);
      if (kind == SpreadKind::kFunction) at->function_reach_rad = prior.function_reach_rad;
      accepted.changes.push_back({prior.joint, kind, old.*place_of(kind), value});
    }
  }
  return accepted;
}

}  // namespace cellcal::calib
