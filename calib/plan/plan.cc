#include "calib/plan/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "calib/model/inverse.h"
#include "calib/model/linear.h"
#include "calib/model/long_work.h"
#include "calib/plan/candidates.h"
#include "calib/plan/choose.h"
#include "calib/plan/online.h"
#include "calib/plan/pool.h"
#include "calib/plan/positioner_plan.h"
#include "calib/plan/route.h"
#include "calib/plan/visit.h"

namespace cellcal::calib {

namespace {

/// Candidates per touch. Three times as many reduce the error of 50 touches of four spheres by 4 %;
/// a third of them increases it by 7 %.
constexpr int kCandidatesPerTouch = 36;
constexpr int kMostCandidates = 500;  // per sphere
/// Arms without closed-form inverse kinematics: each candidate costs a hundred times as much.
constexpr int kCandidatesPerTouchBySearch = 12;
/// Maximum rounds of exchange; they end early if another brings almost nothing.
constexpr int kExchanges = 6;
/// Fewer directions do not constrain a sphere reliably; and half of all touches are distributed
/// evenly, since the choice covers only the errors in the model.
constexpr int kLeastPerSphere = 5;
/// Touches of each target that a plan to a goal begins with.
constexpr int kFirstToGoal = 10;

/// Distance of q from the segment a-b in joint space, maximum norm.
double off_segment(const JointVector& q, const JointVector& a, const JointVector& b) {
  double dot = 0.0, length = 0.0;
  for (std::size_t i = 0; i < q.size(); ++i) {
    dot += (q[i] - a[i]) * (b[i] - a[i]);
    length += (b[i] - a[i]) * (b[i] - a[i]);
  }
  const double s = length > 0.0 ? std::clamp(dot / length, 0.0, 1.0) : 0.0;
  double worst = 0.0;
  for (std::size_t i = 0; i < q.size(); ++i)
    worst = std::max(worst, std::abs(q[i] - a[i] - s * (b[i] - a[i])));
  return worst;
}

/// u95 that a session reaches by these touches, which exclude most model errors.
double foreseen_u95_m(const Choice& choice) { return kBoundOverError * choice.reducible_m; }

/// (92), from a choice; at least a tenth more than that has, unless no more are allowed.
int touches_to_goal(const Choice& choice, const PlanOptions& options) {
  constexpr double kErrorPower = 0.55, kLeastMore = 1.1;
  const auto count = static_cast<double>(choice.picked.size());
  const double more =
      count * std::pow(foreseen_u95_m(choice) / options.goal_u95_m, 1.0 / kErrorPower);
  return static_cast<int>(
      std::min(std::ceil(std::max(more, kLeastMore * count)), 1.0 * options.fit_touches));
}

/// The fit touches; throws if too few are reachable.
Choice choose_connected(const Cell& cell, const ChooseOptions& how, Pool& pool) {
  const std::vector<Candidate>& candidates = pool.candidates();
  Choice choice = choose(cell, candidates, how);
  // If simple paths reach too few touches, paths are sampled.
  std::vector<int> made(cell.targets.size(), 0);
  for (const std::size_t i : choice.picked) ++made[candidates[i].target];
  bool harder = false;
  for (std::size_t t = 0; t < made.size(); ++t)
    if (made[t] < how.least_per_target) harder = pool.try_harder(t) || harder;
  if (harder) choice = choose(cell, candidates, how);
  if (static_cast<int>(choice.picked.size()) < how.count)
    throw PlanError(
        PlanError::Kind::kTooFew,
        fmt::format("only {} of {} touches can be reached by a clear way. Move the targets nearer "
                    "to the middle of the workspace, or plan fewer touches",
                    choice.picked.size(), how.count));
  return choice;
}

/// Chosen and refined; to a goal as many as it takes.
Choice choose_fit_touches(const Cell& cell, const PlanOptions& options, int targets, Pool& pool) {
  ChooseOptions how;
  how.criterion = options.criterion;
  how.region = options.region;
  how.exchanges = kExchanges;
  how.seed = options.seed;
  how.possible = [&pool](std::size_t i) { return pool.connected(i); };
  const std::size_t spread = pool.candidates().size();
  Choice choice;
  const auto choose_of = [&](int count) {
    how.count = count;
    how.least_per_target =
        std::min(std::max(kLeastPerSphere, count / (2 * targets)), count / targets);
    pool.forget(spread, {});
    {
      const Part part(PlanStep::kChoose, kReachShare, kChosenShare);
      choice = choose_connected(cell, how, pool);
    }
    const Part part(PlanStep::kChoose, kChosenShare, kRefinedShare);
    if (options.criterion == Criterion::kI) add_neighbours(cell, pool, spread, how, choice);
  };
  const bool to_goal = options.goal_u95_m > 0.0;
  choose_of(to_goal ? std::min(options.fit_touches, kFirstToGoal * targets) : options.fit_touches);
  while (to_goal && foreseen_u95_m(choice) > options.goal_u95_m && how.count < options.fit_touches)
    choose_of(touches_to_goal(choice, options));
  return choice;
}

}  // namespace

Plan make_plan(const Cell& cell, const PlanOptions& options, const JointVector& from) {
  if (options.goal_u95_m > 0.0)
    refuse_positioner(cell.robot, "a plan to a goal", "Leave --goal out");
  if (!cell.robot.positioner.empty()) return make_positioner_plan(cell, options, from);
  constexpr Kinds kKinds = Kinds::kSpheresAndPlanes;
  const auto targets = static_cast<int>(
      std::count_if(cell.targets.begin(), cell.targets.end(),
                    [](const Target& target) { return is_planned(target, kKinds); }));
  const int total = options.fit_touches + options.check_touches;
  if (options.fit_touches < 1 || options.check_touches < 0)
    throw PlanError(PlanError::Kind::kRequest, "a plan needs at least one fit touch");
  const ArmModel arm = planning_arm(cell);
  const int per_touch = Configurations(arm, options.limit_margin_rad).closed_form()
                            ? kCandidatesPerTouch
                            : kCandidatesPerTouchBySearch;
  std::optional<Part> part(std::in_place, PlanStep::kReach, 0.0, kReachShare);
  Pool pool(cell, options,
            std::clamp(per_touch * total / std::max(1, targets), 40, kMostCandidates), kKinds);
  const std::vector<Candidate>& candidates = pool.candidates();
  if (static_cast<int>(candidates.size()) < total)
    throw PlanError(
        PlanError::Kind::kTooFew,
        fmt::format(
            "only {} touches can be reached inside the joint limits and clear of obstacles, {} are "
            "needed. Move the targets nearer to the middle of the workspace, or plan fewer touches",
            candidates.size(), total));
  const std::size_t spread = candidates.size();  // those distributed over all targets
  part.reset();
  const Choice choice = choose_fit_touches(cell, options, targets, pool);
  part.emplace(PlanStep::kWays, kRefinedShare, 1.0);
  const auto possible = [&](std::size_t i) { return pool.connected(i); };
  std::vector<ToVisit> todo;
  for (const Picked& one :
       with_check_touches(cell, candidates, choice.picked, spread, targets, options, possible))
    todo.push_back({candidates[one.candidate], one.set});
  const JointVector start = from.empty() ? pool.middle() : from;
  if (const auto what = pool.clearance().hit(start, kTipMarginM))
    throw PlanError(
        PlanError::Kind::kArmStands,
        fmt::format("the arm is too close to something to start: {}. Jog it free", words(*what)));
  Plan plan = visit(cell, options, pool.clearance(), pool.router(), std::move(todo), start);
  plan.predicted_mean_m = choice.predicted_mean_m;
  plan.predicted_u95_m = choice.predicted_u95_m;
  if (options.goal_u95_m > 0.0) {
    plan.predicted_u95_m = foreseen_u95_m(choice);
    if (plan.predicted_u95_m > options.goal_u95_m) plan.missing = choice.largest;
  }
  for (const Target& target : cell.targets)
    if (!is_planned(target, kKinds)) plan.left_out.push_back(target.id);
  return plan;
}

Plan resume_plan(const Cell& cell, const Plan& plan, std::size_t next, const JointVector& from) {
  refuse_positioner(cell.robot, "resuming a plan", "Plan anew, 'cellcal plan'");
  if (next >= plan.touches.size()) return plan;
  const ArmModel arm = planning_arm(cell);
  const Clearance clearance(cell, arm);
  Router router(cell, arm, clearance, resting_posture(cell.robot, clearance), 0.0);
  Plan result = plan;
  PlannedTouch& touch = result.touches[next];
  JointVector at = from;
  std::vector<JointVector> way;
  if (!clearance.clear(at, kTipMarginM)) {
    // Inside a search: back along its line.
    constexpr double kOnLineRad = 0.02;
    for (const std::size_t k : {next, next > 0 ? next - 1 : next}) {
      const PlannedTouch& near = plan.touches[k];
      if (off_segment(from, near.clear, near.end) > kOnLineRad) continue;
      // Out of a contact the arm moves alone: a linear unit stays where it stands.
      JointVector out = near.clear;
      std::copy_n(from.begin(), cell.robot.first_turning(), out.begin());
      if (out != near.clear && !clearance.clear(out, kTipMarginM)) continue;
      way.push_back(out);
      at = out;
      break;
    }
    if (way.empty())
      throw PlanError(
          PlanError::Kind::kArmStands,
          fmt::format(
              "the arm is not on the line of its last touch, and at its position {}. Jog it free",
              words_or(clearance.hit(from, kTipMarginM), "something is too close")));
  }
  Candidate to;
  to.target = cell.target_index(touch.target);
  to.normal = touch.normal;
  to.standoff = touch.standoff;
  to.clear = touch.clear;
  to.orientation = arm.nominal_tcp(touch.standoff).linear();
  router.mark_hard(to.target);
  if (!router.connect(to))
    throw PlanError(
        PlanError::Kind::kInTheWay, touch.target,
        fmt::format(
            "{}: no clear way to the next touch of this plan: {}. Check what was changed in the cell",
            touch.target,
            words_or(
                clearance.hit(resting_posture(cell.robot, clearance), touch.standoff, kTipMarginM),
                kBlockedAround)));
  const PlannedTouch& before = plan.touches[next > 0 ? next - 1 : next];
  Candidate leaving;  // its path to the resting posture is unknown, unlike that of `to`
  leaving.target = cell.target_index(before.target);
  leaving.clear = before.clear;
  leaving.orientation = arm.nominal_tcp(leaving.clear).linear();
  const auto rest = router.to_standoff(at, &leaving, to);
  if (!rest)
    throw PlanError(
        PlanError::Kind::kArmStands, touch.target,
        fmt::format(
            "no clear way from the arm's position to the next touch, of {}: {}. Jog it above the "
            "spheres",
            touch.target,
            words_or(clearance.hit(at, touch.standoff, kTipMarginM), kBlockedAround)));
  way.insert(way.end(), rest->begin(), rest->end());
  touch.transit = std::move(way);
  round_corners(clearance, {}, from, touch);
  return result;
}

}  // namespace cellcal::calib
