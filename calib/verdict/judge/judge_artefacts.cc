#include "calib/verdict/judge/judge_artefacts.h"

#include <algorithm>

#include "calib/consistency/artefact_bias.h"
#include "calib/consistency/certified_lengths.h"
#include "calib/problem/target_place.h"

namespace cellcal::calib {

namespace {

/// A joint or tool does not give against its load; noise may say so by this many sigmas.
constexpr double kAgainstLoad = 5.0;
/// A target stands elsewhere than stated, sigmas of its centre.
constexpr double kFarCentre = 5.0;

/// Two certificates of one length; all else is too uncertain to say which of them is wrong.
void judge_certified_twice(const Calibration& c, std::vector<Finding>& findings) {
  for (std::size_t a = 0; a < c.lengths.size(); ++a)
    for (std::size_t b = a + 1; b < c.lengths.size(); ++b) {
      const LengthResult &one = c.lengths[a], &other = c.lengths[b];
      // As if the other certificate were all that is said of the one.
      LengthResult by_other = one;
      by_other.by_others_m = other.certified_m;
      by_other.sigma_m = other.certified_sigma_m;
      if (!same_ends(one, other) || !is_contradicted(by_other)) continue;
      findings.push_back({FindingKind::kCertifiedTwice,
                          Severity::kWithholds,
                          about_length(one.from, one.to),
                          {in_mm("certified", one.certified_m, one.certified_sigma_m),
                           in_mm("certified_again", other.certified_m, other.certified_sigma_m)}});
    }
}

/// Of two targets each is where the other should be.
const Target* exchanged_with(const Problem& problem, const Calibration& c,
                             const TargetResult& one) {
  const Cell& cell = problem.cell();
  const Target& a = cell.targets[cell.target_index(one.id)];
  for (const TargetResult& other : c.targets) {
    const Target& b = cell.targets[cell.target_index(other.id)];
    if (!(one.id < other.id) || !centre_is_held(a) || !centre_is_held(b)) continue;
    const double sigma_m = kFarCentre * std::max(a.centre_sigma_m, b.centre_sigma_m);
    if ((a.centre_m - b.centre_m).norm() < 2.0 * sigma_m) continue;
    if ((one.centre_m - b.centre_m).norm() < sigma_m &&
        (other.centre_m - a.centre_m).norm() < sigma_m)
      return &b;
  }
  return nullptr;
}

}  // namespace

void judge_lengths(const Calibration& c, std::vector<Finding>& findings) {
  const LengthResult* worst = worst_contradicted(c.lengths);
  if (worst == nullptr) {
    judge_certified_twice(c, findings);
    return;
  }
  const auto others = std::count_if(c.lengths.begin(), c.lengths.end(), is_contradicted) - 1;
  findings.push_back({FindingKind::kCertifiedLength,
                      Severity::kWithholds,
                      about_length(worst->from, worst->to),
                      {in_mm("certified", worst->certified_m, worst->certified_sigma_m),
                       in_mm("measured", std::max(0.0, worst->by_others_m), worst->sigma_m),
                       {"apart", contradiction(*worst), "sigma"},
                       {"others", static_cast<double>(others), ""}}});
}

void judge_artefact_biases(const Calibration& c, std::vector<Finding>& findings) {
  const ArtefactBias* worst = worst_contradicted(c.artefact_biases);
  if (worst == nullptr) return;
  // What was touched from one side, or in a plane, moves for its size to second order.
  if (std::any_of(findings.begin(), findings.end(), [&](const Finding& one) {
        return one.kind == FindingKind::kTooFewDirections && one.about.name == worst->target;
      }))
    return;
  Finding finding{FindingKind::kArtefactSize, Severity::kWithholds};
  if (is_of_sphere(c.cell, *worst)) {
    const Target& target = c.cell.targets[c.cell.target_index(worst->target)];
    finding.about = about_target(target);
    finding.evidence = {
        in_mm("stated", target.diameter_m),
        in_mm("measured", target.diameter_m + 2.0 * worst->off_m, 2.0 * worst->sigma_m)};
  } else {
    if (!worst->target.empty())
      finding.about = about_target(c.cell.targets[c.cell.target_index(worst->target)]);
    finding.evidence = {in_mm("longer", worst->off_m, worst->sigma_m)};
  }
  finding.evidence.push_back({"apart", contradiction(*worst), "sigma"});
  findings.push_back(std::move(finding));
}

void judge_loads(const Problem& problem, const Calibration& c, std::vector<Finding>& findings) {
  for (int p = 0; p < problem.arm_size(); ++p) {
    const ParameterKind kind = problem.arm().parameters()[p].kind;
    if (kind != ParameterKind::kCompliance && kind != ParameterKind::kDeflection) continue;
    const ParameterResult& found = c.parameters[static_cast<std::size_t>(p)];
    const double value = found.nominal + found.correction;
    if (found.sigma > 0.0 && value < -kAgainstLoad * found.sigma)
      findings.push_back(
          {FindingKind::kNegativeCompliance,
           Severity::kWithholds,
           about_parameter(c.cell, found.key),
           {{"value", value * found.to_unit, found.unit, found.sigma * found.to_unit},
            {"below_zero", -value / found.sigma, "sigma"}}});
  }
}

void note_untouched(const Problem& problem, std::vector<Finding>& findings) {
  Finding finding{FindingKind::kNotTouched, Severity::kWarns};
  const auto& targets = problem.cell().targets;
  for (std::size_t t = 0; t < targets.size(); ++t)
    if (std::none_of(problem.blocks().begin(), problem.blocks().end(),
                     [&](const TargetBlock& block) { return block.target == t; }) &&
        std::none_of(problem.touches().begin(), problem.touches().end(),
                     [&](const Touch& touch) { return touch.target == targets[t].id; }))
      finding.parts.push_back({about_target(targets[t]), {}});
  if (finding.parts.empty()) return;
  const auto& lengths = problem.cell().lengths;
  const auto idle =
      std::count_if(lengths.begin(), lengths.end(), [&](const CertifiedLength& length) {
        return std::any_of(finding.parts.begin(), finding.parts.end(), [&](const FindingPart& one) {
          return one.about.name == length.from || one.about.name == length.to;
        });
      });
  finding.evidence = {{"idle_lengths", static_cast<double>(idle), ""}};
  findings.push_back(std::move(finding));
}

void note_centres(const Problem& problem, const Calibration& c, std::vector<Finding>& findings) {
  Finding far{FindingKind::kStatedCentre, Severity::kWarns};
  for (const TargetResult& found : c.targets) {
    const Target& target = problem.cell().targets[problem.cell().target_index(found.id)];
    if (!centre_is_held(target)) continue;
    const double off_m = (found.centre_m - target.centre_m).norm();
    if (off_m > kFarCentre * target.centre_sigma_m)
      far.parts.push_back(
          {about_target(target),
           {in_mm("off", off_m), {"apart", off_m / target.centre_sigma_m, "sigma"}}});
  }
  if (far.parts.empty()) return;
  for (const TargetResult& one : c.targets)
    if (const Target* other = exchanged_with(problem, c, one)) {
      const Target& target = problem.cell().targets[problem.cell().target_index(one.id)];
      findings.push_back({FindingKind::kExchangedCentres,
                          Severity::kWarns,
                          {},
                          {},
                          {{about_target(target), {}}, {about_target(*other), {}}}});
      return;
    }
  std::stable_sort(far.parts.begin(), far.parts.end(),
                   [](const FindingPart& a, const FindingPart& b) {
                     return value(a.evidence, "apart") > value(b.evidence, "apart");
                   });
  findings.push_back(std::move(far));
}

}  // namespace cellcal::calib
