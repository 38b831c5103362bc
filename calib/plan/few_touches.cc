#include "calib/plan/few_touches.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calib/check/foresight.h"
#include "calib/estimate/predict.h"
#include "calib/model/linear.h"
#include "calib/plan/aim.h"
#include "calib/plan/duration.h"
#include "calib/plan/plan.h"
#include "calib/plan/pool.h"
#include "calib/plan/visit.h"

namespace cellcal::calib {

namespace {

constexpr int kCandidatesForFew = 300;
/// Angles of variations added around the picks: the touches most sensitive to a shift across the tool are at the
/// boundary of the feasible set.
constexpr double kLookAroundFewRad[] = {0.25, 0.1};
constexpr int kAroundFew = 60;  ///< per angle

const TargetResult* known_sphere(const Calibration& calibration, const Target& target) {
  if (target.kind != TargetKind::kSphere) return nullptr;
  const auto found = std::ranges::find(calibration.targets, target.id, &TargetResult::id);
  return found == calibration.targets.end() ? nullptr : &*found;
}

/// Sets the predicted sigma of each contact.
void set_predicted_sigmas(const Calibration& calibration, Plan& plan) {
  std::vector<Touch> contacts;
  for (const PlannedTouch& planned : plan.touches) {
    contacts.emplace_back();
    contacts.back().target = planned.target;
    const double share = planned.expected_m / planned.search_m;
    for (std::size_t i = 0; i < planned.standoff.size(); ++i)
      contacts.back().joint_rad.push_back(planned.standoff[i] +
                                          share * (planned.end[i] - planned.standoff[i]));
  }
  const Eigen::MatrixXd covariance_m2 = foresee(calibration, contacts).covariance_m2();
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    plan.touches[k].expected_sigma_m = std::sqrt(covariance_m2(i, i));
  }
}

}  // namespace

Cell as_known(const Calibration& calibration) {
  Cell cell = calibration.cell;
  bool any = false;
  for (Target& target : cell.targets) {
    const TargetResult* known = known_sphere(calibration, target);
    target.obstacle_only = known == nullptr;
    if (known == nullptr) continue;
    any = target.has_centre = true;
    target.centre_m = known->centre_m;
  }
  if (!any)
    throw PlanError(
        PlanError::Kind::kCalibration,
        "the calibration contains no sphere: only spheres can be touched. Calibrate first");
  return cell;
}

Plan make_few_touches(const Calibration& calibration, const PlanOptions& options,
                      const CheckPlanOptions& how, const JointVector& from,
                      const ChoiceOfFew& choose) {
  const Cell cell = as_known(calibration);
  const Predictor predictor(calibration);
  Pool pool(cell, options, kCandidatesForFew);
  const JointVector start = from.empty() ? pool.middle() : from;
  if (const auto what = pool.clearance().hit(start, kTipMarginM))
    throw PlanError(
        PlanError::Kind::kArmStands,
        fmt::format("the arm is too close to something to start: {}. Jog it free", words(*what)));
  const Aim aim = [&](const Candidate& candidate, PlannedTouch& touch) {
    const TargetResult& sphere = *known_sphere(calibration, cell.targets[candidate.target]);
    const Surface surface{sphere.centre_m, candidate.normal, sphere.effective_radius_m,
                          [&](const JointVector& q) -> Eigen::Vector3d {
                            return predictor.calibrated(q).tcp.translation();
                          }};
    aim_at(pool, options, surface, {how.before_m, how.behind_m}, candidate, touch);
    touch.may_miss = true;
  };
  Pace pace;
  pace.predicted_m = how.before_m;
  const auto possible = [&](std::size_t candidate) { return pool.connected(candidate); };
  Random random(options.seed);
  const std::size_t spread = pool.candidates().size();
  for (int count = how.most_touches;; --count) {
    pool.forget(spread, {});
    auto picked = choose(pool.candidates(), count, possible);
    for (const double by_rad : kLookAroundFewRad) {
      pool.vary(picked, kAroundFew * count, by_rad, random);
      picked = choose(pool.candidates(), count, possible);
    }
    if (static_cast<int>(picked.size()) < how.least_touches)
      throw PlanError(PlanError::Kind::kTooFew,
                      fmt::format("only {} touches can be reached by a clear way, {} are needed",
                                  picked.size(), how.least_touches));
    std::vector<ToVisit> todo;
    for (const std::size_t c : picked) todo.push_back({pool.candidates()[c], how.set});
    Plan plan = visit(cell, options, pool.clearance(), pool.router(), std::move(todo), start, aim);
    if (count > how.least_touches && duration_s(plan, cell.robot, pace) > how.most_s) continue;
    set_predicted_sigmas(calibration, plan);
    return plan;
  }
}

}  // namespace cellcal::calib
