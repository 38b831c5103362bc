#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "calib/estimate/target.h"
#include "calib/model/enum_table.h"
#include "calib/verdict/artefacts.h"
#include "calib/verdict/held_out.h"
#include "calib/verdict/judge.h"
#include "calib/verdict/residuals.h"

namespace cellcal::calib {

namespace {

/// Residuals twice as large as stated give chi^2/dof = 4: the noise differs from the cell file, or
/// the arm has errors outside the model.
constexpr double kChi2Limit = 4.0;
/// A tenth may be gross errors; chance leads to a higher share.
constexpr double kOutlierShare = 0.15;
/// Share of one target: with more left out the others determine its place poorly, unless there are
/// enough of them; the second limit then applies.
constexpr double kOutlierShareOfTarget = 0.20, kOutlierShareOfMany = 1.0 / 3.0;
constexpr int kEnoughOthers = 15;
/// The others agree with the stated noise: chi^2 per degree of freedom.
constexpr double kAsStated = 1.5;
/// One touch left out is normal if this many remain.
constexpr int kLeastOtherTouches = 4;

/// A check touch, and the other target that it lies on, if any.
FindingPart check_touch(const Problem& problem, const Calibration& c, const TouchResidual& r) {
  FindingPart part{about_touch(r.touch, problem.touches()[r.touch]),
                   {in_mm("off", std::abs(r.after_m))}};
  if (const auto other = lies_on(problem, c, r)) part.about.other_end = *other;
  return part;
}

bool is_check(const Problem& problem, const TouchResidual& r) {
  return problem.touches()[r.touch].set == TouchSet::kCheck;
}

/// A joint or tool does not deflect against its load; noise may suggest it up to this many sigmas.
constexpr double kAgainstLoad = 5.0;
/// Sigmas of the centre beyond which a target counts as misplaced.
constexpr double kFarCentre = 5.0;

/// Two certificates of one length; all other data are too uncertain to determine which of them is
/// wrong.
void judge_certified_twice(const Calibration& c, Verdict& verdict) {
  for (std::size_t a = 0; a < c.lengths.size(); ++a)
    for (std::size_t b = a + 1; b < c.lengths.size(); ++b) {
      const LengthResult &one = c.lengths[a], &other = c.lengths[b];
      // As if the other certificate were the only data on this one.
      LengthResult by_other = one;
      by_other.by_others_m = other.certified_m;
      by_other.sigma_m = other.certified_sigma_m;
      if (!same_ends(one, other) || !is_contradicted(by_other)) continue;
      verdict.add({FindingKind::kCertifiedTwice,
                   Severity::kWithholds,
                   about_length(one.from, one.to),
                   {in_mm("certified", one.certified_m, one.certified_sigma_m),
                    in_mm("certified_again", other.certified_m, other.certified_sigma_m)}});
    }
}

/// Two targets, each at the other's place.
const Target* exchanged_with(const Problem& problem, const Calibration& c,
                             const TargetResult& one) {
  const Cell& cell = problem.cell();
  const Target& a = cell.targets[cell.target_index(one.id)];
  for (const TargetResult& other : c.targets) {
    const Target& b = cell.targets[cell.target_index(other.id)];
    if (!(one.id < other.id) || !centre_is_held(a) || !centre_is_held(b) ||
        a.carried_by != b.carried_by)
      continue;
    const double sigma_m = kFarCentre * std::max(a.centre_sigma_m, b.centre_sigma_m);
    if ((a.centre_m - b.centre_m).norm() < 2.0 * sigma_m) continue;
    if ((one.centre_m - b.centre_m).norm() < sigma_m &&
        (other.centre_m - a.centre_m).norm() < sigma_m)
      return &b;
  }
  return nullptr;
}

}  // namespace

void judge_scatter(const Problem& problem, const Calibration& c, Verdict& verdict) {
  if (!(c.chi2_per_dof > kChi2Limit)) return;
  const double stated_m = c.repeats.used_m > 0.0 ? c.repeats.used_m : problem.cell().touch_sigma_m;
  verdict.add({FindingKind::kTouchScatter,
               Severity::kWithholds,
               {},
               {in_mm("scatter", c.touch_noise_m),
                in_mm("stated", stated_m),
                {"ratio", std::sqrt(c.chi2_per_dof)},
                {"repeats", c.repeats.degrees_of_freedom > 0.0}}});
}

void judge_outliers(const Problem& problem, const Calibration& c, Verdict& verdict) {
  const auto touches = problem.touches();
  std::vector<int> fit(problem.blocks().size(), 0), outliers = fit;
  for (const TouchResidual& r : c.residuals) {
    if (touches[r.touch].set != TouchSet::kFit) continue;
    const auto block = static_cast<std::size_t>(problem.block_of(r.touch));
    ++fit[block];
    if (r.outlier) ++outliers[block];
  }
  const int all = std::accumulate(fit.begin(), fit.end(), 0),
            out = std::accumulate(outliers.begin(), outliers.end(), 0);
  if (out > kOutlierShare * all) {
    verdict.add({FindingKind::kManyOutliers,
                 Severity::kWithholds,
                 {},
                 {{"outliers", out}, {"touches", all}, {"allowed", 100.0 * kOutlierShare, "%"}}});
    return;
  }
  for (std::size_t b = 0; b < fit.size(); ++b) {
    const double most = fit[b] - outliers[b] < kEnoughOthers || c.chi2_per_dof > kAsStated
                            ? kOutlierShareOfTarget
                            : kOutlierShareOfMany;
    if (outliers[b] > 0 && outliers[b] >= most * fit[b] &&
        (outliers[b] > 1 || fit[b] - 1 < kLeastOtherTouches))
      verdict.add({FindingKind::kOutliersOfTarget,
                   Severity::kWithholds,
                   about_target(problem.cell().targets[problem.blocks()[b].target]),
                   {{"outliers", outliers[b]}, {"touches", fit[b]}}});
  }
}

void judge_check_touches(const Problem& problem, const Calibration& c, Verdict& verdict) {
  std::vector<HeldOut> checks = held_out(problem, c);
  std::erase_if(checks, [&](const HeldOut& one) { return c.residuals[one.touch].outlier; });
  checks.insert(checks.end(), c.unseen.held_out.begin(), c.unseen.held_out.end());
  const double ratio = rms_of(checks);
  if (!(ratio > kCheckRatio)) return;
  Finding finding{FindingKind::kCheckTouches,
                  Severity::kWithholds,
                  {},
                  {in_mm("rms", c.check.rms_m), {"ratio", ratio}}};
  for (const TouchResidual& r : c.residuals) {
    if (!is_check(problem, r) || r.outlier || std::isnan(r.after_m)) continue;
    FindingPart part = check_touch(problem, c, r);
    if (!part.about.other_end.empty()) finding.parts.push_back(std::move(part));
  }
  verdict.add(std::move(finding));
}

void note_touches(const Problem& problem, const Calibration& c, Verdict& verdict) {
  std::vector<const TouchResidual*> gross;
  for (const TouchResidual& r : c.residuals)
    if (is_check(problem, r) && r.outlier) gross.push_back(&r);
  std::ranges::stable_sort(gross, std::greater{},
                           [](const TouchResidual* one) { return std::abs(one->whitened); });
  if (!gross.empty()) {
    Finding finding{FindingKind::kGrossCheckTouches, Severity::kWarns};
    for (const TouchResidual* r : gross) finding.parts.push_back(check_touch(problem, c, *r));
    verdict.add(std::move(finding));
  }
  if (auto temperature = temperature_finding(problem.touches()))
    verdict.add(std::move(*temperature));
  for (const UnseenTarget& unseen : c.unseen.targets) {
    const Cell& cell = problem.cell();
    Finding finding{FindingKind::kUnseenPlace, Severity::kInforms,
                    about_target(cell.targets[cell.target_index(unseen.target)])};
    const Quantity touches{"touches", unseen.touches};
    if (unseen.not_judged) {
      finding.kind = FindingKind::kUnseenNotJudged;
      finding.severity = Severity::kWarns;
      finding.evidence = {touches, {own_name(*unseen.not_judged), true}};
    } else {
      finding.evidence = {
          in_mm("rms", unseen.rms_m), touches, {"degrees_of_freedom", unseen.degrees_of_freedom}};
    }
    verdict.add(std::move(finding));
  }
  if (c.check.count == 0) verdict.add({FindingKind::kNoCheckTouches, Severity::kWarns});
}

void judge_lengths(const Calibration& c, Verdict& verdict) {
  const LengthResult* worst = worst_contradicted(c.lengths);
  if (worst == nullptr) {
    judge_certified_twice(c, verdict);
    return;
  }
  const auto others = std::count_if(c.lengths.begin(), c.lengths.end(), is_contradicted) - 1;
  verdict.add({FindingKind::kCertifiedLength,
               Severity::kWithholds,
               about_length(worst->from, worst->to),
               {in_mm("certified", worst->certified_m, worst->certified_sigma_m),
                in_mm("measured", std::max(0.0, worst->by_others_m), worst->sigma_m),
                {"apart", contradiction(*worst), "sigma"},
                {"others", others}}});
}

void judge_artefact_biases(const Calibration& c, Verdict& verdict) {
  const ArtefactBias* worst = worst_contradicted(c.artefact_biases);
  if (worst == nullptr) return;
  // For touches from one side, or in a plane, the size has a second-order effect.
  if (std::ranges::any_of(verdict.findings, [&](const Finding& one) {
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
  verdict.add(std::move(finding));
}

void judge_loads(const Problem& problem, const Calibration& c, Verdict& verdict) {
  for (int p = 0; p < problem.arm_size(); ++p) {
    const ArmParameter& parameter = problem.arm().parameters()[static_cast<std::size_t>(p)];
    if (parameter.kind != ParameterKind::kCompliance &&
        parameter.kind != ParameterKind::kDeflection && !is_positioner_compliance(parameter))
      continue;
    const ParameterResult& found = c.parameters[static_cast<std::size_t>(p)];
    const double value = found.nominal + found.correction;
    if (found.sigma > 0.0 && value < -kAgainstLoad * found.sigma)
      verdict.add({FindingKind::kNegativeCompliance,
                   Severity::kWithholds,
                   about_parameter(c.cell, found.key),
                   {{"value", value * found.to_unit, found.unit, found.sigma * found.to_unit},
                    {"below_zero", -value / found.sigma, "sigma"}}});
  }
}

void note_untouched(const Problem& problem, Verdict& verdict) {
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
  finding.evidence = {{"idle_lengths", idle}};
  verdict.add(std::move(finding));
}

void note_centres(const Problem& problem, const Calibration& c, Verdict& verdict) {
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
      verdict.add({FindingKind::kExchangedCentres,
                   Severity::kWarns,
                   {},
                   {},
                   {{about_target(target), {}}, {about_target(*other), {}}}});
      return;
    }
  std::ranges::stable_sort(far.parts, std::greater{},
                           [](const FindingPart& one) { return value(one.evidence, "apart"); });
  verdict.add(std::move(far));
}

std::optional<Finding> temperature_finding(std::span<const Touch> touches) {
  double coldest = 0.0, hottest = 0.0;
  std::size_t stated = 0;
  for (const Touch& touch : touches) {
    if (!touch.temperature_c) continue;
    coldest = stated == 0 ? *touch.temperature_c : std::min(coldest, *touch.temperature_c);
    hottest = stated == 0 ? *touch.temperature_c : std::max(hottest, *touch.temperature_c);
    ++stated;
  }
  if (stated == 0) return std::nullopt;
  Finding finding{FindingKind::kTemperature, Severity::kInforms};
  finding.evidence = {{"coldest", coldest, "degrees C"},
                      {"hottest", hottest, "degrees C"},
                      {"stated", stated},
                      {"touches", touches.size()}};
  return finding;
}

}  // namespace cellcal::calib
