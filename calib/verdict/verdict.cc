#include "calib/verdict/verdict.h"

#include <algorithm>
#include <cmath>

#include "calib/verdict/held_out.h"
#include "calib/verdict/judge.h"
#include "calib/verdict/residuals.h"

namespace cellcal::calib {

namespace {

/// Share of the geometry's directions: below it the tolerances determine the result instead of the
/// touches.
constexpr double kDeterminedShare = 0.5;

/// Shift by an undetected wrong contact, over the predicted mean error: u95 is about three times
/// that. Of sessions at four spheres none of 100 touches exceeds five, of 50 one in a hundred, of
/// 30 most.
constexpr double kMostUnchecked = 5.0;

bool is_determined(const Calibration& c) {
  return c.observability.determined >= kDeterminedShare * c.observability.directions;
}

Finding undetermined(const Calibration& c) {
  return {FindingKind::kRank,
          Severity::kWithholds,
          {},
          {{"determined", c.observability.determined}, {"directions", c.observability.directions}}};
}

/// True if further touches would resolve all findings.
bool wants_touches_alone(const Verdict& verdict) {
  return !verdict.findings.empty() && std::ranges::all_of(verdict.findings, [](const Finding& one) {
    return one.kind == FindingKind::kRank || one.kind == FindingKind::kTooFewDirections;
  });
}

/// A session with fewer touches of each target is a first session.
constexpr std::size_t kBegunPerTarget = 5;

/// Distance of the nominal tip at contact from its target's stated place; empty if not stated.
std::optional<double> met_off_m(const Problem& problem, const Touch& touch) {
  const Cell& cell = problem.cell();
  const Target& target = cell.targets[cell.target_index(touch.target)];
  const bool plane = target.kind == TargetKind::kPlane && target.has_normal;
  if (!target.has_centre || (!plane && target.kind != TargetKind::kSphere)) return std::nullopt;
  const Eigen::Vector3d from_centre =
      problem.arm().nominal_tip_m(touch.joint_rad, 0, carrier_rad(touch, target)) - target.centre_m;
  const double surface =
      plane ? from_centre.dot(target.normal) : from_centre.norm() - target.diameter_m / 2.0;
  return std::abs(surface - cell.tool.tip_radius_m);
}

/// Fewer touches than a calibration requires.
bool has_only_begun(const Problem& problem) {
  const auto fit = std::count_if(problem.touches().begin(), problem.touches().end(),
                                 [](const Touch& touch) { return touch.set == TouchSet::kFit; });
  return static_cast<std::size_t>(fit) < kBegunPerTarget * problem.blocks().size();
}

/// Result of a first session of a few touches, a test of the cell, and the recommended number.
Finding first_session(const Problem& problem) {
  int met = 0;
  double farthest_m = 0.0;
  for (const Touch& touch : problem.touches())
    if (const auto off = met_off_m(problem, touch)) {
      ++met;
      farthest_m = std::max(farthest_m, *off);
    }
  Finding finding{FindingKind::kTooFewTouches,
                  Severity::kWithholds,
                  {},
                  {{"touches", problem.touches().size()},
                   {"usual_touches", kUsualTouches},
                   {"usual_checks", kUsualChecks}}};
  if (met > 0) {
    finding.evidence.push_back({"met", met});
    finding.evidence.push_back(in_mm("farthest", farthest_m));
  }
  return finding;
}

}  // namespace

Verdict judge(const Problem& problem, const Calibration& c) {
  Verdict verdict{.judged = true};
  judge_scatter(problem, c, verdict);
  if (auto copies = duplicate_touches(problem.touches())) verdict.add(std::move(*copies));
  judge_outliers(problem, c, verdict);
  const bool determined = is_determined(c);
  if (!determined && !holds_where_measured(problem.cell(), c)) verdict.add(undetermined(c));
  const HeldPlaces places = judge_places(problem, c, verdict);
  judge_lengths(c, verdict);
  judge_artefact_biases(c, verdict);
  judge_loads(problem, c, verdict);
  judge_radius(problem, c, verdict);
  judge_nominal_geometry(problem, c, verdict);
  judge_check_touches(problem, c, verdict);
  if (wants_touches_alone(verdict) && has_only_begun(problem)) {
    verdict.findings = {first_session(problem)};
    note_untouched(problem, verdict);
    return verdict;
  }
  const Scale scale = scale_of(problem, places);
  verdict.workspace = scale.held();
  shrink_scope(problem, c, determined, verdict);
  judge_predicted(problem.cell(), c, verdict);

  note_scope(problem, c, places, scale, verdict);
  if (verdict.publish()) note_gain(problem.cell(), c, verdict);
  note_model_error(problem, c, verdict);
  note_untouched(problem, verdict);
  note_centres(problem, c, verdict);
  if (verdict.publish()) note_tolerances(problem, c, verdict);
  note_touches(problem, c, verdict);
  return verdict;
}

void warn_of_unchecked_touch(std::span<const Touch> touches, Calibration& c) {
  Verdict& verdict = c.verdict;
  if (!verdict.publish()) return;
  const UncheckedTouch& one = verdict.workspace ? c.unchecked_workspace : c.unchecked_near_targets;
  const double predicted_m =
      verdict.workspace ? c.predicted_workspace_m : c.predicted_near_targets_m;
  if (!(one.shift_m > kMostUnchecked * predicted_m)) return;
  verdict.add_first({FindingKind::kUncheckedTouch,
                     Severity::kWarns,
                     about_touch(one.touch, touches[one.touch]),
                     {in_mm("unseen", one.unseen_m), in_mm("shift", one.shift_m),
                      in_mm("predicted", predicted_m)}});
}

}  // namespace cellcal::calib
