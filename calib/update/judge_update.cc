#include "calib/update/judge_update.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "calib/verdict/judge/judge_accuracy.h"

namespace cellcal::calib {

namespace {

Subject about(const Explanation& one, const Cell& cell) {
  switch (one.kind) {
    case ChangeKind::kTool:
      return about_tool(one.name);
    case ChangeKind::kSphere:
      return about_target(cell.targets[cell.target_index(one.name)]);
    case ChangeKind::kJoint:
      return about_joint(one.name);
    default:
      return {};
  }
}

std::vector<Quantity> evidence_of(const Explanation& one) {
  constexpr double kPerMillion = 1e6;
  switch (one.kind) {
    case ChangeKind::kTool:
    case ChangeKind::kSphere:
      return shift_in_mm(one.shift_m, one.sigma);
    case ChangeKind::kJoint:
      return {in_deg("turn", one.amount, one.sigma)};
    case ChangeKind::kGrowth:
      return {{"growth", one.amount * kPerMillion, "ppm", one.sigma * kPerMillion}};
    case ChangeKind::kTouch:
      return {in_mm("off", one.amount, one.sigma)};
    case ChangeKind::kNothing:
      break;
  }
  return {};
}

FindingKind finding_of(UpdateOutcome outcome) {
  switch (outcome) {
    case UpdateOutcome::kUpdated:
      return FindingKind::kUpdated;
    case UpdateOutcome::kNothingChanged:
      return FindingKind::kUpdateNotNeeded;
    case UpdateOutcome::kContradicted:
      return FindingKind::kUpdateContradicted;
    case UpdateOutcome::kNotResolved:
      return FindingKind::kUpdateNotResolved;
    case UpdateOutcome::kNotFound:
      return FindingKind::kUpdateNotFound;
    case UpdateOutcome::kTooFewTouches:
      return FindingKind::kUpdateTooFew;
  }
  return FindingKind::kUpdateNotResolved;
}

}  // namespace

void judge_update(Calibration& c) {
  const UpdateOrigin& origin = *c.update;
  c.verdict.publish = origin.outcome == UpdateOutcome::kUpdated;
  Finding finding{finding_of(origin.outcome),
                  c.verdict.publish ? Severity::kInforms : Severity::kWithholds};
  finding.text = origin.stands_on;
  if (!origin.explanations.empty()) {
    finding.about = about(origin.explanations.front(), c.cell);
    finding.evidence = evidence_of(origin.explanations.front());
    finding.evidence.push_back(
        {"probability", 100.0 * origin.explanations.front().probability, "%"});
  }
  finding.evidence.push_back({"touches", static_cast<double>(origin.touches), ""});
  finding.evidence.push_back(in_mm("reached", origin.reached_m));
  finding.evidence.push_back(in_mm("before", origin.before_m));
  for (const std::string& id : origin.not_found)
    finding.parts.push_back({about_target(c.cell.targets[c.cell.target_index(id)]), {}});
  if (origin.outcome == UpdateOutcome::kContradicted && origin.second)
    finding.parts.push_back({about(*origin.second, c.cell), evidence_of(*origin.second)});
  c.verdict.findings = {std::move(finding)};
  if (!c.verdict.publish) return;
  // An update is held to what a full session is held to.
  judge_predicted(c.cell, c, c.verdict.workspace, c.verdict.findings);
  c.verdict.publish = std::ranges::none_of(
      c.verdict.findings, [](const Finding& one) { return one.severity == Severity::kWithholds; });
  if (c.verdict.publish) note_gain(c.cell, c, c.verdict.workspace, c.verdict.findings);
}

}  // namespace cellcal::calib
