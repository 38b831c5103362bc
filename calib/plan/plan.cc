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
#include "calib/plan/touch_sequence.h"
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
  choose_to_goal(options, targets, choose_of, choice);
  return choice;
}

}  // namespace

Plan make_plan(const Cell& cell, const PlanOptions& options, const JointVector& from) {
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
  foresee(choice, options, plan);
  for (const Target& target : cell.targets)
    if (!is_planned(target, kKinds)) plan.left_out.push_back(target.id);
  return plan;
}

namespace {

/// Out of a search that the arm stopped in, `lines`: back along its line. Empty: the arm is clear.
/// `as_planned`: what is around their ends has not moved.
std::optional<JointVector> out_of_search(const Cell& cell, const Clearance& clearance,
                                         std::initializer_list<const PlannedTouch*> lines,
                                         const JointVector& from, bool as_planned) {
  if (clearance.clear(from, kTipMarginM)) return std::nullopt;
  for (const PlannedTouch* near : lines) {
    if (!way_out_of({near->target, {near->standoff}, near->end, {near->clear}}, from)) continue;
    // Out of a contact the arm moves alone: a linear unit stays.
    JointVector out = near->clear;
    std::copy_n(from.begin(), cell.robot.first_turning(), out.begin());
    if ((out != near->clear || !as_planned) && !clearance.clear(out, kTipMarginM)) continue;
    if (clearance.clear_search(from, out, cell.target_index(near->target), kTipMarginM)) return out;
  }
  throw PlanError(
      PlanError::Kind::kArmStands,
      fmt::format(
          "no clear way back along the line of the last touch, and at the arm's position {}. "
          "Jog it free",
          words_or(clearance.hit(from, kTipMarginM), "something is too close")));
}

Candidate leaving_at(const Cell& cell, const ArmModel& arm, const std::string& target,
                     const JointVector& clear) {
  Candidate leaving;  // its path to the resting posture is unknown
  leaving.target = cell.target_index(target);
  leaving.clear = clear;
  leaving.orientation = arm.nominal_tcp(clear).linear();
  return leaving;
}

/// The touch with its transit from `from`. `before`: made last, else itself. `rest`: as of a Router.
PlannedTouch resumed_touch(const Cell& cell, const ArmModel& arm, const Clearance& clearance,
                           const JointVector& rest, PlannedTouch touch, const PlannedTouch& before,
                           const JointVector& from) {
  Router router(cell, arm, clearance, rest, 0.0);
  std::vector<JointVector> way;
  if (const auto out = out_of_search(cell, clearance, {&touch, &before}, from, true))
    way.push_back(*out);
  const JointVector at = way.empty() ? from : way.back();
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
            words_or(clearance.hit(rest, touch.standoff, kTipMarginM), kBlockedAround)));
  const Candidate leaving = leaving_at(cell, arm, before.target, before.clear);
  const auto onward = router.to_standoff(at, &leaving, to);
  if (!onward)
    throw PlanError(
        PlanError::Kind::kArmStands, touch.target,
        fmt::format(
            "no clear way from the arm's position to the next touch, of {}: {}. Jog it above the "
            "spheres",
            touch.target,
            words_or(clearance.hit(at, touch.standoff, kTipMarginM), kBlockedAround)));
  way.insert(way.end(), onward->begin(), onward->end());
  touch.transit = std::move(way);
  round_corners(clearance, {}, from, touch);
  return touch;
}

/// Waypoints to where the arm waits, also out of a search on either touch whose sphere the positioner has
/// moved since.
std::vector<JointVector> way_to_wait(const Cell& still, const JointVector& start,
                                     const PlannedTouch& touch, const PlannedTouch& last,
                                     const JointVector& from) {
  const ArmModel arm = planning_arm(still);
  const Clearance clearance(still, arm);
  std::vector<JointVector> way;
  if (const auto out = out_of_search(still, clearance, {&touch, &last}, from, false))
    way.push_back(*out);
  const JointVector at = way.empty() ? from : way.back();
  const auto onward =
      Router(still, arm, clearance, start, 0.0).to_rest(leaving_at(still, arm, last.target, at));
  if (!onward)
    throw PlanError(
        PlanError::Kind::kArmStands,
        fmt::format(
            "no clear way to where the arm waits while the positioner turns: {}. Jog it there",
            words_or(clearance.hit(at, start, kTipMarginM), kBlockedAround)));
  way.insert(way.end(), onward->begin(), onward->end());
  return way;
}

/// The touches from `next` on at its setting, at the positioner's present angles.
void adopt_present_setting(Plan& plan, std::size_t next,
                           const std::vector<double>& positioner_rad) {
  const std::vector<double> setting = plan.touches[next].positioner_rad;
  for (std::size_t k = next; k < plan.touches.size(); ++k) {
    PlannedTouch& touch = plan.touches[k];
    if (touch.positioner_rad != setting) {
      touch.wait_rad = positioner_rad;
      return;
    }
    touch.positioner_rad = positioner_rad;
  }
}

PlannedTouch resumed_at_setting(const Cell& cell, const JointVector& start, PlannedTouch touch,
                                const PlannedTouch& before, const JointVector& from) {
  const Cell still = at_setting(cell, touch.positioner_rad);
  const ArmModel arm = planning_arm(still);
  const Clearance clearance(still, arm);
  return resumed_touch(still, arm, clearance, start, std::move(touch), before, from);
}

Plan resume_with_positioner(const Cell& cell, Plan plan, std::size_t next, const JointVector& from,
                            const std::vector<double>& positioner_rad) {
  if (positioner_rad.size() != cell.robot.positioner.size())
    throw PlanError(PlanError::Kind::kRequest, "the angles of the positioner's axes are not known");
  PlannedTouch& touch = plan.touches[next];
  const PlannedTouch last = plan.touches[next > 0 ? next - 1 : next];
  if (stands_at(positioner_rad, touch.positioner_rad)) {
    const bool made_here = stands_at(last.positioner_rad, touch.positioner_rad);
    adopt_present_setting(plan, next, positioner_rad);
    touch = resumed_at_setting(cell, plan.start, touch, made_here ? last : touch, from);
    touch.wait.clear();
    touch.wait_rad.clear();
    return plan;
  }
  require_clear_turn(cell, positioner_rad, touch.positioner_rad, plan.start);
  touch.wait = way_to_wait(at_setting(cell, positioner_rad), plan.start, touch, last, from);
  touch.wait_rad = positioner_rad;
  touch = resumed_at_setting(cell, plan.start, touch, touch, plan.start);
  return plan;
}

}  // namespace

Plan resume_plan(const Cell& cell, const Plan& plan, std::size_t next, const JointVector& from,
                 const std::vector<double>& positioner_rad) {
  if (next >= plan.touches.size()) return plan;
  if (!cell.robot.positioner.empty())
    return resume_with_positioner(cell, plan, next, from, positioner_rad);
  const ArmModel arm = planning_arm(cell);
  const Clearance clearance(cell, arm);
  Plan result = plan;
  result.touches[next] =
      resumed_touch(cell, arm, clearance, resting_posture(cell.robot, clearance),
                    plan.touches[next], plan.touches[next > 0 ? next - 1 : next], from);
  return result;
}

}  // namespace cellcal::calib
