#include "calib/verdict/judge/tolerances.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace cellcal::calib {

namespace {

/// An arm this many tolerances off nominal is another arm: real ones stay within five
/// (real-data tests), a wrong row of the robot file makes twenty and more and can still be
/// explained away. Before that it is told.
constexpr double kFarFromNominal = 6.0, kBeyondTolerance = 4.0;
/// All lengths of an arm together: chance does not take them so many sigmas off.
constexpr double kFarScale = 4.0;
/// The arm itself may be off the other way, sigmas.
constexpr double kLuck = 2.0;
/// The effective radius may be off by what its prior says: chance is warned of, and then not believed.
constexpr double kWarnedRadius = 2.0, kFarRadius = 3.0;

/// Whether it is not one length alone.
bool is_of_all_lengths(const Problem& problem, const Calibration& c, const ArmScale& scale) {
  constexpr double kFarWithoutOne = 2.0;
  for (int p = 0; p < problem.arm_size(); ++p) {
    const ArmScale others = arm_scale(problem, c, p);
    if (!(others.off * scale.off > 0.0) || !(std::abs(others.off) > kFarWithoutOne * others.sigma))
      return false;
  }
  return true;
}

/// Errors of more than `most` tolerances, the farthest first.
std::vector<FindingPart> beyond_tolerance(const Problem& problem, const Calibration& c,
                                          double most) {
  std::vector<FindingPart> far;
  for (int p = 0; p < problem.arm_size(); ++p) {
    const ParameterKind kind = problem.arm().parameters()[p].kind;
    if (!is_geometric(kind) && kind != ParameterKind::kTcp) continue;
    const ParameterResult& found = c.parameters[static_cast<std::size_t>(p)];
    const double tolerances = std::abs(found.correction) / problem.unknowns()[p].scale;
    if (!(tolerances > most)) continue;
    far.push_back(
        {about_parameter(c.cell, found.key),
         {{"off", found.correction * found.to_unit, found.unit}, {"tolerances", tolerances, ""}}});
  }
  std::stable_sort(far.begin(), far.end(), [](const FindingPart& a, const FindingPart& b) {
    return value(a.evidence, "tolerances") > value(b.evidence, "tolerances");
  });
  return far;
}

/// Where the tip meets its targets elsewhere than the files say; none within `most` sigmas.
std::optional<Finding> radius_off(const Problem& problem, const Calibration& c, double most,
                                  Severity severity) {
  int worst = -1;
  for (int tool = 0; tool < problem.arm().tool_count(); ++tool) {
    const int rho = problem.rho(tool);
    if (rho >= 0 &&
        (worst < 0 || std::abs(c.parameters[static_cast<std::size_t>(rho)].correction) >
                          std::abs(c.parameters[static_cast<std::size_t>(worst)].correction)))
      worst = rho;
  }
  if (worst < 0) return std::nullopt;
  const ParameterResult& rho = c.parameters[static_cast<std::size_t>(worst)];
  const double sigma_m = problem.unknowns()[static_cast<std::size_t>(worst)].scale;
  if (!(std::abs(rho.correction) > most * sigma_m)) return std::nullopt;
  return Finding{
      FindingKind::kEffectiveRadius,
      severity,
      about_parameter(c.cell, rho.key),
      {in_mm("off", rho.correction), {"apart", std::abs(rho.correction) / sigma_m, "sigma"}}};
}

}  // namespace

double ArmScale::unseen() const { return (kFarScale + kLuck) * sigma; }

ArmScale arm_scale(const Problem& problem, const Calibration& c, int but) {
  double information = 0.0, pull = 0.0;
  for (int p = 0; p < problem.arm_size(); ++p) {
    const ParameterKind kind = problem.arm().parameters()[p].kind;
    if ((kind != ParameterKind::kD && kind != ParameterKind::kA) || p == but) continue;
    const Joint& joint =
        problem.arm().robot().joints[static_cast<std::size_t>(problem.arm().parameters()[p].joint)];
    const double drawn_m = kind == ParameterKind::kD ? joint.d_m : joint.a_m;
    const double square = std::pow(problem.unknowns()[p].scale, 2);
    information += drawn_m * drawn_m / square;
    pull += drawn_m * c.parameters[static_cast<std::size_t>(p)].correction / square;
  }
  if (!(information > 0.0)) return {};
  return {pull / information, 1.0 / std::sqrt(information)};  // (57)
}

void judge_nominal_geometry(const Problem& problem, const Calibration& c,
                            std::vector<Finding>& findings) {
  constexpr double kAnotherArm = 50.0;
  const ArmScale scale = arm_scale(problem, c);
  if (scale.sigma > 0.0 && std::abs(scale.off) > kFarScale * scale.sigma &&
      is_of_all_lengths(problem, c, scale))
    findings.push_back({FindingKind::kArmScale,
                        Severity::kWithholds,
                        {},
                        {{"off", 100.0 * scale.off, "%", 100.0 * scale.sigma},
                         {"apart", std::abs(scale.off) / scale.sigma, "sigma"}}});
  std::vector<FindingPart> far = beyond_tolerance(problem, c, kFarFromNominal);
  if (far.empty()) return;
  const bool may_be_so = value(far.front().evidence, "tolerances") < kAnotherArm;
  findings.push_back({FindingKind::kOffNominal,
                      Severity::kWithholds,
                      {},
                      {{"may_be_so", may_be_so ? 1.0 : 0.0, ""}},
                      std::move(far)});
}

void judge_radius(const Problem& problem, const Calibration& c, std::vector<Finding>& findings) {
  if (auto off = radius_off(problem, c, kFarRadius, Severity::kWithholds))
    findings.push_back(std::move(*off));
}

void note_tolerances(const Problem& problem, const Calibration& c, std::vector<Finding>& findings) {
  if (auto off = radius_off(problem, c, kWarnedRadius, Severity::kWarns))
    findings.push_back(std::move(*off));
  std::vector<FindingPart> far = beyond_tolerance(problem, c, kBeyondTolerance);
  if (!far.empty())
    findings.push_back({FindingKind::kOffNominal, Severity::kWarns, {}, {}, std::move(far)});
}

}  // namespace cellcal::calib
