#include "calib/verdict/judge/judge_touches.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "calib/consistency/named_outliers.h"
#include "calib/verdict/judge/held_out.h"
#include "calib/verdict/judge/temperature.h"

namespace cellcal::calib {

namespace {

/// Residuals twice as large as stated leave chi^2/dof at 4: the noise is not what the cell file
/// says, or the arm has errors that the model lacks.
constexpr double kChi2Limit = 4.0;
/// A tenth of all may be gross errors, and chance makes more of it.
constexpr double kOutlierShare = 0.15;
/// Of one target's: with so many left out the others say too little of its place, unless there are
/// enough of them; then so many are still chance.
constexpr double kOutlierShareOfTarget = 0.20, kOutlierShareOfMany = 1.0 / 3.0;
constexpr int kEnoughOthers = 15;
/// And the others are as stated: chi^2 per degree of freedom.
constexpr double kAsStated = 1.5;
/// One touch left out is the usual case where so many remain, and what the outliers are for.
constexpr int kEnoughBesideOne = 4;

/// A check touch, and the other target that it lies on, if it does.
FindingPart check_touch(const Problem& problem, const Calibration& c, const TouchResidual& r) {
  FindingPart part{about_touch(r.touch, problem.touches()[r.touch]),
                   {in_mm("off", std::abs(r.after_m))}};
  if (const auto other = lies_on(problem, c, r)) part.about.other_end = *other;
  return part;
}

/// What the finding has where it is so, and the sentence asks for.
const char* name_of(UnseenTarget::NotJudged why) {
  switch (why) {
    case UnseenTarget::NotJudged::kPlaceAlone:
      return "place_alone";
    case UnseenTarget::NotJudged::kNoPlace:
      return "no_place";
    case UnseenTarget::NotJudged::kUnusable:
      return "unusable";
    case UnseenTarget::NotJudged::kOtherNormal:
      return "other_normal";
  }
  return "";
}

bool is_check(const Problem& problem, const TouchResidual& r) {
  return problem.touches()[r.touch].set == TouchSet::kCheck;
}

}  // namespace

void judge_scatter(const Problem& problem, const Calibration& c, std::vector<Finding>& findings) {
  if (!(c.chi2_per_dof > kChi2Limit)) return;
  const double stated_m = c.repeats.used_m > 0.0 ? c.repeats.used_m : problem.cell().touch_sigma_m;
  findings.push_back({FindingKind::kTouchScatter,
                      Severity::kWithholds,
                      {},
                      {in_mm("scatter", c.touch_noise_m),
                       in_mm("stated", stated_m),
                       {"ratio", std::sqrt(c.chi2_per_dof), ""},
                       {"repeats", c.repeats.degrees_of_freedom > 0.0 ? 1.0 : 0.0, ""}}});
}

void judge_outliers(const Problem& problem, const Calibration& c, std::vector<Finding>& findings) {
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
    findings.push_back({FindingKind::kManyOutliers,
                        Severity::kWithholds,
                        {},
                        {{"outliers", static_cast<double>(out), ""},
                         {"touches", static_cast<double>(all), ""},
                         {"allowed", 100.0 * kOutlierShare, "%"}}});
    return;
  }
  for (std::size_t b = 0; b < fit.size(); ++b) {
    const double most = fit[b] - outliers[b] < kEnoughOthers || c.chi2_per_dof > kAsStated
                            ? kOutlierShareOfTarget
                            : kOutlierShareOfMany;
    if (outliers[b] > 0 && outliers[b] >= most * fit[b] &&
        (outliers[b] > 1 || fit[b] - 1 < kEnoughBesideOne))
      findings.push_back({FindingKind::kOutliersOfTarget,
                          Severity::kWithholds,
                          about_target(problem.cell().targets[problem.blocks()[b].target]),
                          {{"outliers", static_cast<double>(outliers[b]), ""},
                           {"touches", static_cast<double>(fit[b]), ""}}});
  }
}

void judge_check_touches(const Problem& problem, const Calibration& c,
                         std::vector<Finding>& findings) {
  std::vector<HeldOut> checks = held_out(problem, c);
  std::erase_if(checks, [&](const HeldOut& one) { return c.residuals[one.touch].outlier; });
  checks.insert(checks.end(), c.unseen.held_out.begin(), c.unseen.held_out.end());
  const double ratio = rms_of(checks);
  if (!(ratio > kCheckRatio)) return;
  Finding finding{FindingKind::kCheckTouches,
                  Severity::kWithholds,
                  {},
                  {in_mm("rms", c.check.rms_m), {"ratio", ratio, ""}}};
  for (const TouchResidual& r : c.residuals) {
    if (!is_check(problem, r) || r.outlier || std::isnan(r.after_m)) continue;
    FindingPart part = check_touch(problem, c, r);
    if (!part.about.other_end.empty()) finding.parts.push_back(std::move(part));
  }
  findings.push_back(std::move(finding));
}

void note_touches(const Problem& problem, const Calibration& c, std::vector<Finding>& findings) {
  std::vector<const TouchResidual*> gross;
  for (const TouchResidual& r : c.residuals)
    if (is_check(problem, r) && r.outlier) gross.push_back(&r);
  std::stable_sort(gross.begin(), gross.end(), [](const TouchResidual* a, const TouchResidual* b) {
    return std::abs(a->whitened) > std::abs(b->whitened);
  });
  if (!gross.empty()) {
    Finding finding{FindingKind::kGrossCheckTouches, Severity::kWarns};
    for (const TouchResidual* r : gross) finding.parts.push_back(check_touch(problem, c, *r));
    findings.push_back(std::move(finding));
  }
  if (auto temperature = temperature_finding(problem.touches()))
    findings.push_back(std::move(*temperature));
  for (const UnseenTarget& unseen : c.unseen.targets) {
    const Cell& cell = problem.cell();
    Finding finding{FindingKind::kUnseenPlace, Severity::kInforms,
                    about_target(cell.targets[cell.target_index(unseen.target)])};
    const Quantity touches{"touches", static_cast<double>(unseen.touches), ""};
    if (unseen.not_judged) {
      finding.kind = FindingKind::kUnseenNotJudged;
      finding.severity = Severity::kWarns;
      finding.evidence = {touches, {name_of(*unseen.not_judged), 1.0, ""}};
    } else {
      finding.evidence = {in_mm("rms", unseen.rms_m),
                          touches,
                          {"degrees_of_freedom", unseen.degrees_of_freedom, ""}};
    }
    findings.push_back(std::move(finding));
  }
  if (c.check.count == 0) findings.push_back({FindingKind::kNoCheckTouches, Severity::kWarns});
}

}  // namespace cellcal::calib
