#include "calib/result/calibration.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <regex>
#include <utility>

#include "calib/model/units.h"
#include "calib/result/finding_phrase.h"

namespace cellcal::calib {

namespace {

constexpr SourceUnit kMm{"mm", kMmPerM}, kDeg{"deg", kDegPerRad},
    kArcsec{"arcsec", 1.0 / kRadPerArcsec}, kSeveral{"", 1.0};
constexpr EnumTable<UncertaintySource, SourceUnit> kSourceUnits{
    {{UncertaintySource::kTouches, kMm},
     {UncertaintySource::kCertifiedLengths, kMm},
     {UncertaintySource::kDiameters, kMm},
     {UncertaintySource::kEffectiveRadius, kMm},
     {UncertaintySource::kLatchDelay, {"ms", kMsPerS}},
     {UncertaintySource::kTool, kMm},
     {UncertaintySource::kArmLengths, kMm},
     {UncertaintySource::kArmAngles, kDeg},
     {UncertaintySource::kLinearUnit, kSeveral},
     {UncertaintySource::kTransmission, kArcsec},
     {UncertaintySource::kLoads, kSeveral},
     {UncertaintySource::kPlaces, kMm},
     {UncertaintySource::kRipple, kArcsec},
     {UncertaintySource::kModel, kMm}}};

/// Index of each of the arm's parameters in the calibration, -1 if absent.
std::vector<Eigen::Index> places(const ArmModel& arm, const Calibration& c) {
  std::map<ParameterKey, Eigen::Index> index;
  for (std::size_t i = 0; i < c.parameters.size(); ++i)
    index[c.parameters[i].key] = static_cast<Eigen::Index>(i);
  std::vector<Eigen::Index> at;
  for (const ArmParameter& parameter : arm.parameters()) {
    const auto found = index.find(parameter);
    at.push_back(found == index.end() ? -1 : found->second);
  }
  return at;
}

}  // namespace

SourceUnit unit_of(UncertaintySource source) { return kSourceUnits[source]; }

bool Verdict::publish() const {
  return judged && std::ranges::none_of(findings, &Finding::withholds);
}

bool Verdict::too_few() const {
  return has(findings, FindingKind::kTooFewTouches) &&
         std::ranges::all_of(findings, [](const Finding& one) {
           return !one.withholds() || one.kind == FindingKind::kTooFewTouches;
         });
}

ScaleBy Verdict::scale() const {
  return has(findings, FindingKind::kScaleByLengths)    ? ScaleBy::kLengths
         : has(findings, FindingKind::kScaleByReadings) ? ScaleBy::kReadings
         : has(findings, FindingKind::kScaleByNothing)  ? ScaleBy::kNothing
                                                        : ScaleBy::kNotJudged;
}

void Verdict::add(Finding finding) {
  const auto place = finding.withholds() ? std::ranges::find_if_not(findings, &Finding::withholds)
                                         : findings.end();
  findings.insert(place, std::move(finding));
}

void Verdict::add_first(Finding finding) {
  const auto place = finding.withholds() ? findings.begin()
                                         : std::ranges::find_if_not(findings, &Finding::withholds);
  findings.insert(place, std::move(finding));
}

std::vector<ZeroOffset> zero_offsets(const Calibration& c) {
  std::vector<ZeroOffset> all;
  for (std::size_t i = 0; i < c.cell.robot.joints.size(); ++i) {
    const Joint& joint = c.cell.robot.joints[i];
    if (const auto* found = find(c, joint_parameter(ParameterKind::kTheta, i)))
      all.push_back({joint.name, joint.sign * found->correction, found->sigma, found->decided_by});
  }
  return all;
}

std::vector<JointFunction> joint_functions(const Calibration& c) {
  constexpr double kStepRad = 0.5 * kRadPerDeg, kNormal975 = 1.959963984540054;
  std::vector<JointFunction> all;
  for (std::size_t j = 0; j < c.cell.robot.joints.size(); ++j) {
    std::vector<Eigen::Index> coefficients;
    for (std::size_t i = 0; i < c.parameters.size(); ++i)
      if (is_function(c.parameters[i].key.kind) && c.parameters[i].key.joint == static_cast<int>(j))
        coefficients.push_back(static_cast<Eigen::Index>(i));
    const Joint& joint = c.cell.robot.joints[j];
    const double range = joint.function_max_rad - joint.function_min_rad;
    if (coefficients.empty() || !(range > 0.0)) continue;
    Eigen::MatrixXd covariance;
    if (c.covariance.size() > 0) covariance = c.covariance(coefficients, coefficients);
    JointFunction one{j, {}, {}, {}};
    int fastest = 0;
    for (const Eigen::Index i : coefficients)
      fastest = std::max(fastest, c.parameters[static_cast<std::size_t>(i)].key.harmonic);
    const double step_rad = fastest > kHighestOrder ? 0.5 * kStepRad : kStepRad;
    const int steps = std::max(1, static_cast<int>(std::ceil(range / step_rad)));
    for (int k = 0; k <= steps; ++k) {
      const double angle = joint.function_min_rad + range * k / steps;
      Eigen::VectorXd wave(static_cast<Eigen::Index>(coefficients.size()));
      double error = 0.0;
      for (Eigen::Index i = 0; i < wave.size(); ++i) {
        const ParameterResult& p =
            c.parameters[static_cast<std::size_t>(coefficients[static_cast<std::size_t>(i)])];
        const double phase = p.key.harmonic * angle;
        wave[i] = p.key.kind == ParameterKind::kFunctionCosine ? std::cos(phase) : std::sin(phase);
        error += wave[i] * p.correction;
      }
      const double variance = covariance.size() == 0 ? 0.0 : wave.dot(covariance * wave);
      one.angle_rad.push_back(angle);
      one.error_rad.push_back(error);
      one.u95_rad.push_back(kNormal975 * std::sqrt(std::max(0.0, variance)));
    }
    all.push_back(std::move(one));
  }
  return all;
}

double stated_value(const Cell& cell, const ParameterKey& parameter) {
  if (parameter.kind == ParameterKind::kTcp) {
    const auto index = static_cast<std::size_t>(parameter.tool);
    const Tool& tool = index == 0 ? cell.tool : cell.other_tools.at(index - 1);
    return tool.tcp.translation()[parameter.axis];
  }
  if (!is_geometric(parameter.kind)) return 0.0;
  const Joint& joint = cell.robot.joints.at(static_cast<std::size_t>(parameter.joint));
  switch (parameter.kind) {
    case ParameterKind::kTheta: return joint.offset_rad;
    case ParameterKind::kD: return joint.d_m;
    case ParameterKind::kA: return joint.a_m;
    case ParameterKind::kAlpha: return joint.alpha_rad;
    case ParameterKind::kGuide: return 0.0;
    default: return joint.beta_rad;
  }
}

Eigen::VectorXd arm_values(const ArmModel& arm, const Calibration& c) {
  const auto at = places(arm, c);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(arm.size());
  for (int i = 0; i < arm.size(); ++i) {
    if (at[i] < 0) continue;
    const ParameterResult& p = c.parameters[static_cast<std::size_t>(at[i])];
    x[i] = p.nominal + p.correction;
  }
  return x;
}

Eigen::MatrixXd arm_covariance(const ArmModel& arm, const Calibration& c) {
  if (c.covariance.size() == 0) return {};
  const auto at = places(arm, c);
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(arm.size(), arm.size());
  for (int i = 0; i < arm.size(); ++i)
    for (int j = 0; j < arm.size(); ++j)
      if (at[i] >= 0 && at[j] >= 0) result(i, j) = c.covariance(at[i], at[j]);
  return result;
}

Phrase calibration_phrase(const std::string& in_file) {
  static const std::regex kSession(R"(session (\d+) of (\d{4}-\d\d-\d\d))");
  std::smatch found;
  if (!std::regex_match(in_file, found, kSession)) return in_file;
  return {"say.session_of", {{"n", found[1].str()}, {"date", found[2].str()}}};
}

}  // namespace cellcal::calib
