#include "calib/plan/choice/aim.h"

#include <algorithm>

#include "calib/estimate/target_place.h"
#include "calib/model/inverse.h"

namespace cellcal::calib {

namespace {

/// The search begins this many sigmas and a millimetre before the surface is expected: contact in
/// its first millimetre counts as something else.
constexpr double kStandoffSigmas = 6.0, kStandoffLeastM = 0.003, kStandoffExtraM = 0.001;

}  // namespace

void aim(const Known& known, const Candidate& candidate, PlannedTouch& touch) {
  const Pool& pool = known.pool;
  const PlanOptions& options = known.options;
  const Problem& problem = known.estimate.problem();
  const ArmModel& arm = problem.arm();
  const Eigen::VectorXd x = known.estimate.x_si();
  const double reach = std::clamp(kStandoffSigmas * known.sigma_m + kStandoffExtraM,
                                  kStandoffLeastM, options.standoff_m);
  const auto& blocks = problem.blocks();
  const auto block = std::find_if(blocks.begin(), blocks.end(), [&](const TargetBlock& b) {
    return b.target == candidate.target;
  });
  const Target& target = problem.cell().targets[candidate.target];
  const double radius =
      problem.nominal_radius_m(target, 0) + (problem.rho() >= 0 ? x[problem.rho()] : 0.0);
  const TargetResult known_place =
      result_at(target, problem.place(*block), x.data() + block->first);
  Eigen::Vector3d centre = known_place.centre_m, normal = candidate.normal;
  if (target.kind == TargetKind::kPlane) {  // the place on it that the candidate goes to
    normal = known_place.normal;
    const Eigen::Vector3d there = pool.arm().nominal_tip_m(candidate.contact);
    centre = there - (normal.dot(there) - known_place.distance_m) * normal;
  }
  const ArmErrors errors = arm.errors(x.data());
  ArmChain chain;
  const auto at = [&](double outside_m, const JointVector& seed) -> std::optional<JointVector> {
    const Eigen::Vector3d wanted = centre + (radius + outside_m) * normal;
    Eigen::Isometry3d command = Eigen::Isometry3d::Identity();
    command.linear() = candidate.orientation;
    command.translation() = wanted;
    std::optional<JointVector> q = seed;
    constexpr int kCorrections = 4;  // each leaves a thousandth
    for (int k = 0; k < kCorrections; ++k) {
      q = inverse(pool.arm(), command, *q, options.limit_margin_rad);
      if (!q) return std::nullopt;
      arm.walk(arm.prepare(*q), errors, chain);
      command.translation() += wanted - chain.tip;
    }
    return q;
  };
  const auto standoff = at(reach, candidate.contact), end = at(-reach, candidate.contact);
  if (!standoff || !end) return;
  if (!pool.clearance().clear_search(candidate.clear, *end, candidate.target, kTipMarginM)) return;
  // First to the stand-off that an arm needs that is not known, then straight on: a way from far
  // off that ends so near the surface would keep less from it than the nominal arm is wrong by.
  if (!pool.clearance().clear_search(touch.standoff, *standoff, candidate.target, kTipMarginM))
    return;
  touch.transit.push_back(*standoff);
  touch.standoff = *standoff;
  touch.end = *end;
  touch.search_m = 2.0 * reach;
  touch.expected_m = reach;
  touch.expected_sigma_m = known.sigma_m;
}

}  // namespace cellcal::calib
