#include "calib/plan/aim.h"

#include <algorithm>

#include "calib/estimate/target.h"
#include "calib/model/inverse.h"

namespace cellcal::calib {

namespace {

/// Distance from the start of the search to the expected surface, in sigmas plus a millimetre:
/// contact within the first millimetre is not accepted as a touch.
constexpr double kStandoffSigmas = 6.0, kStandoffLeastM = 0.003, kStandoffExtraM = 0.001;

}  // namespace

void aim(const Known& known, const Candidate& candidate, PlannedTouch& touch) {
  const Pool& pool = known.pool;
  const PlanOptions& options = known.options;
  const Problem& problem = known.estimate.problem();
  const ArmModel& arm = problem.arm();
  const Eigen::VectorXd x = known.estimate.x_si();
  const double reach = std::clamp(kStandoffSigmas * known.sigma_m + kStandoffExtraM,
                                  kStandoffLeastM, touch.expected_m);
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
  if (target.kind == TargetKind::kPlane) {  // place of the candidate on the plane
    normal = known_place.normal;
    const Eigen::Vector3d there = pool.arm().nominal_tip_m(candidate.contact);
    centre = there - (normal.dot(there) - known_place.distance_m) * normal;
  }
  const ArmErrors errors = arm.errors(x.data());
  const Surface surface{centre, normal, radius, [&](const JointVector& q) {
                          ArmChain chain;
                          arm.walk(arm.prepare(q), errors, chain);
                          return chain.tip;
                        }};
  if (!aim_at(pool, options, surface, {reach, reach}, candidate, touch)) return;
  touch.expected_sigma_m = known.sigma_m;
}

bool aim_at(const Pool& pool, const PlanOptions& options, const Surface& surface,
            const SearchLength& length, const Candidate& candidate, PlannedTouch& touch) {
  const auto at = [&](double outside_m, const JointVector& seed) -> std::optional<JointVector> {
    const Eigen::Vector3d wanted =
        surface.centre_m + (surface.radius_m + outside_m) * surface.normal;
    Eigen::Isometry3d command(candidate.orientation);
    command.translation() = wanted;
    std::optional<JointVector> q = seed;
    constexpr int kCorrections = 4;  // each leaves a thousandth
    for (int k = 0; k < kCorrections; ++k) {
      q = inverse(pool.arm(), command, *q, options.limit_margin_rad);
      if (!q) return std::nullopt;
      command.translation() += wanted - surface.tip_m(*q);
    }
    return q;
  };
  const auto standoff = at(length.before_m, candidate.contact),
             end = at(-length.behind_m, candidate.contact);
  if (!standoff || !end) return false;
  if (!pool.clearance().clear_search(candidate.clear, *end, candidate.target)) return false;
  // Via the stand-off for an unknown arm, then straight on: a transit from far away that ends so
  // near the surface would have less clearance than the error of the nominal arm.
  if (!pool.clearance().clear_search(touch.standoff, *standoff, candidate.target)) return false;
  touch.transit.push_back(*standoff);
  touch.standoff = *standoff;
  touch.end = *end;
  touch.search_m = length.before_m + length.behind_m;
  touch.expected_m = length.before_m;
  return true;
}

}  // namespace cellcal::calib
