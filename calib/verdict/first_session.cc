#include "calib/verdict/first_session.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace cellcal::calib {

namespace {

/// A session that has made fewer of each target has only begun.
constexpr std::size_t kBegunPerTarget = 5;
/// That suffice for most cells; what a first session says to go on with.
constexpr int kUsualTouches = 50, kUsualChecks = 10;

/// How far from its stated place a nominal tip met its target; none where that is not stated.
std::optional<double> met_off_m(const Problem& problem, const Touch& touch) {
  const Cell& cell = problem.cell();
  const Target& target = cell.targets[cell.target_index(touch.target)];
  const bool plane = target.kind == TargetKind::kPlane && target.has_normal;
  if (!target.has_centre || (!plane && target.kind != TargetKind::kSphere)) return std::nullopt;
  const Eigen::Vector3d from_centre =
      problem.arm().nominal_tip_m(touch.joint_rad) - target.centre_m;
  const double surface =
      plane ? from_centre.dot(target.normal) : from_centre.norm() - target.diameter_m / 2.0;
  return std::abs(surface - cell.tool.tip_radius_m);
}

}  // namespace

bool has_only_begun(const Problem& problem) {
  const auto fit = std::count_if(problem.touches().begin(), problem.touches().end(),
                                 [](const Touch& touch) { return touch.set == TouchSet::kFit; });
  return static_cast<std::size_t>(fit) < kBegunPerTarget * problem.blocks().size();
}

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
                  {{"touches", static_cast<double>(problem.touches().size()), ""},
                   {"usual_touches", kUsualTouches, ""},
                   {"usual_checks", kUsualChecks, ""}}};
  if (met > 0) {
    finding.evidence.push_back({"met", static_cast<double>(met), ""});
    finding.evidence.push_back(in_mm("farthest", farthest_m));
  }
  return finding;
}

}  // namespace cellcal::calib
