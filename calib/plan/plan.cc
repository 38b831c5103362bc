#include "calib/plan/plan.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <string>
#include <utility>

#include "calib/model/inverse.h"
#include "calib/model/linear.h"
#include "calib/model/long_work.h"
#include "calib/plan/candidates.h"
#include "calib/plan/cell_check.h"
#include "calib/plan/choose.h"
#include "calib/plan/design.h"
#include "calib/plan/online.h"
#include "calib/plan/pool.h"
#include "calib/plan/positioner_plan.h"
#include "calib/plan/route.h"
#include "calib/plan/touch_sequence.h"
#include "calib/plan/track.h"
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

/// The last leg of a touch's transit, which may pass from a stand-off to a nearer one, as a point or two.
std::vector<JointVector> last_leg(const PlannedTouch& touch) {
  if (touch.transit.empty()) return {touch.standoff};
  return {touch.transit.end() - std::min<std::ptrdiff_t>(2, std::ssize(touch.transit)),
          touch.transit.end()};
}

/// Position of the arm, and whether the tip is in contact there.
struct Standing {
  const JointVector& from;
  bool in_contact;
};

/// Out of a search that the arm stopped in, `lines`: back along its line. Empty: the arm is clear.
/// `as_planned`: what is around their ends has not moved.
std::optional<JointVector> out_of_search(const Cell& cell, const Clearance& clearance,
                                         std::initializer_list<const PlannedTouch*> lines,
                                         const Standing& at, bool as_planned) {
  const auto& [from, in_contact] = at;
  if (!in_contact && clearance.clear(from)) return std::nullopt;
  for (const PlannedTouch* near : lines) {
    if (!way_out_of({near->target, last_leg(*near), near->end, {near->clear}}, from, in_contact))
      continue;
    // Out of a contact the arm moves alone: a linear unit stays.
    JointVector out = near->clear;
    std::copy_n(from.begin(), cell.robot.first_turning(), out.begin());
    if ((out != near->clear || !as_planned) && !clearance.clear(out)) continue;
    if (clearance.clear_search(from, out, cell.target_index(near->target))) return out;
  }
  throw PlanError(
      PlanError::Kind::kArmStands,
      fmt::format(
          "at the arm's position {}, and no clear way leads back along a search line. Jog it free",
          words_or(clearance.hit(from),
                   in_contact ? "the tip is in contact" : "something is too close")));
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
                           const Standing& standing) {
  Router router(cell, arm, clearance, rest, 0.0);
  std::vector<JointVector> way;
  if (const auto out = out_of_search(cell, clearance, {&touch, &before}, standing, true))
    way.push_back(*out);
  const JointVector at = way.empty() ? standing.from : way.back();
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
            touch.target, words_or(clearance.hit(rest, touch.standoff), kBlockedAround)));
  const Candidate leaving = leaving_at(cell, arm, before.target, before.clear);
  const auto onward = router.to_standoff(at, &leaving, to);
  if (!onward)
    throw PlanError(
        PlanError::Kind::kArmStands, touch.target,
        fmt::format(
            "no clear way from the arm's position to the next touch, of {}: {}. Jog it above the "
            "spheres",
            touch.target, words_or(clearance.hit(at, touch.standoff), kBlockedAround)));
  way.insert(way.end(), onward->begin(), onward->end());
  touch.transit = std::move(way);
  round_corners(clearance, {}, standing.from, touch);
  return touch;
}

/// Waypoints to where the arm waits, also out of a search on either touch whose sphere the positioner has
/// moved since.
std::vector<JointVector> way_to_wait(const Cell& still, const JointVector& start,
                                     const PlannedTouch& touch, const PlannedTouch& last,
                                     const Standing& standing) {
  const ArmModel arm = planning_arm(still);
  const Clearance clearance(still, arm);
  std::vector<JointVector> way;
  if (const auto out = out_of_search(still, clearance, {&touch, &last}, standing, false))
    way.push_back(*out);
  const JointVector at = way.empty() ? standing.from : way.back();
  const auto onward =
      Router(still, arm, clearance, start, 0.0).to_rest(leaving_at(still, arm, last.target, at));
  if (!onward)
    throw PlanError(
        PlanError::Kind::kArmStands,
        fmt::format(
            "no clear way to where the arm waits while the positioner turns: {}. Jog it there",
            words_or(clearance.hit(at, start), kBlockedAround)));
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
                                const PlannedTouch& before, const Standing& standing) {
  const Cell still = at_setting(cell, touch.positioner_rad);
  const ArmModel arm = planning_arm(still);
  const Clearance clearance(still, arm);
  return resumed_touch(still, arm, clearance, start, std::move(touch), before, standing);
}

Plan resume_with_positioner(const Cell& cell, Plan plan, std::size_t next, const Standing& standing,
                            const std::vector<double>& positioner_rad) {
  if (positioner_rad.size() != cell.robot.positioner.size())
    throw PlanError(PlanError::Kind::kRequest, "the angles of the positioner's axes are not known");
  PlannedTouch& touch = plan.touches[next];
  const PlannedTouch last = plan.touches[next > 0 ? next - 1 : next];
  if (stands_at(positioner_rad, touch.positioner_rad)) {
    const bool made_here = stands_at(last.positioner_rad, touch.positioner_rad);
    adopt_present_setting(plan, next, positioner_rad);
    touch = resumed_at_setting(cell, plan.start, touch, made_here ? last : touch, standing);
    touch.wait.clear();
    touch.wait_rad.clear();
    return plan;
  }
  require_clear_turn(cell, positioner_rad, touch.positioner_rad, plan.start);
  touch.wait = way_to_wait(at_setting(cell, positioner_rad), plan.start, touch, last, standing);
  touch.wait_rad = positioner_rad;
  touch = resumed_at_setting(cell, plan.start, touch, touch, {plan.start, false});
  return plan;
}

using Eigen::Vector3d;

constexpr int kPostures = 600;
constexpr std::size_t kMostPlaces = 32;
constexpr double kApartM = 0.15;        ///< closer places carry the same information
constexpr double kGridM = 0.01;         ///< resolution of placing a stand
constexpr double kCentreSigmaM = 0.01;  ///< as for files without one
/// Above the floor, or the arm's foot if that is higher: higher stands sway.
constexpr double kHighestM = 1.0;
constexpr double kAroundBoxM = 0.2;  ///< margin around a box for places of spheres
constexpr std::size_t kSides = 12;   ///< touches by which a place is evaluated
/// Minimum variance of the touch directions along any axis; a twelfth for half a sphere.
constexpr double kLeastSpread = 0.05;
constexpr double kLengthSigmaM = 5e-6;
constexpr int kExchangeRounds = 4;
constexpr double kPaysShare = 1e-3;  ///< minimum relative gain of an exchange

struct Place {
  Vector3d centre_m;
  std::vector<Candidate> touches;
};

/// The sphere of that id, else the first.
const Target& like(const Cell& cell, const std::string& id) {
  const auto own = std::ranges::find(cell.targets, id, &Target::id);
  if (own != cell.targets.end() && own->kind == TargetKind::kSphere) return *own;
  const auto sphere = std::ranges::find(cell.targets, TargetKind::kSphere, &Target::kind);
  if (sphere == cell.targets.end())
    throw PlanError(
        PlanError::Kind::kRequest,
        "the cell has no sphere to suggest places for. Add one with its diameter to the cell file");
  return *sphere;
}

Target sphere_at(const Target& like, const Vector3d& centre_m, std::string id) {
  Target target = like;
  target.id = std::move(id);
  target.has_centre = true;
  target.has_box = false;
  target.centre_m = centre_m;
  target.centre_sigma_m = kCentreSigmaM;
  return target;
}

/// Ids of the current spheres, followed by unused ones of S1, S2, ...
std::vector<std::string> ids_of(const Cell& cell, std::size_t count) {
  std::vector<std::string> ids;
  for (const Target& target : cell.targets)
    if (target.kind == TargetKind::kSphere && ids.size() < count) ids.push_back(target.id);
  for (int number = 1; ids.size() < count; ++number) {
    const std::string id = fmt::format("S{}", number);
    if (std::ranges::find(ids, id) == ids.end() &&
        std::ranges::find(cell.targets, id, &Target::id) == cell.targets.end())
      ids.push_back(id);
  }
  return ids;
}

/// Spheres at these places before the cell's other targets, with certified lengths between all of them if the cell has
/// one.
Cell with_spheres(const Cell& cell, const std::vector<Vector3d>& centres_m) {
  Cell result = cell;
  result.targets.clear();
  result.lengths.clear();
  const std::vector<std::string> ids = ids_of(cell, centres_m.size());
  double sigma_m = 0.0;
  for (const CertifiedLength& one : cell.lengths) sigma_m = std::max(sigma_m, one.sigma_m);
  for (std::size_t k = 0; k < centres_m.size(); ++k) {
    result.targets.push_back(sphere_at(like(cell, ids[k]), centres_m[k], ids[k]));
    for (std::size_t j = 0; j < k && !cell.lengths.empty(); ++j)
      result.lengths.push_back({result.targets[j].id, result.targets[k].id,
                                (centres_m[j] - centres_m[k]).norm(),
                                sigma_m > 0.0 ? sigma_m : kLengthSigmaM});
  }
  std::ranges::copy_if(cell.targets, std::back_inserter(result.targets),
                       [](const Target& one) { return one.kind != TargetKind::kSphere; });
  return result;
}

bool from_many_sides(const std::vector<Candidate>& touches) {
  if (touches.size() < kSides) return false;
  Vector3d mean = Vector3d::Zero();
  Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
  for (const Candidate& c : touches) {
    mean += c.normal / static_cast<double>(touches.size());
    square += c.normal * c.normal.transpose() / static_cast<double>(touches.size());
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(square - mean * mean.transpose(),
                                                              Eigen::EigenvaluesOnly);
  return solver.eigenvalues()[0] >= kLeastSpread;
}

/// True if only this sphere makes the cell faulty.
bool is_refused_for(const Cell& cell, const std::string& sphere) {
  return std::ranges::any_of(faults_of(cell), [&](const CellFault& fault) {
    return fault.refused && std::ranges::find(fault.ids, sphere) != fault.ids.end();
  });
}

/// Empty if it cannot be touched from many sides.
std::optional<Place> place_at(const Cell& cell, const ArmModel& arm, const PlanOptions& options,
                              const Vector3d& centre_m) {
  const Cell alone = with_spheres(cell, {centre_m});
  const Clearance clearance(alone, arm);
  // A sphere that obstructs the resting arm blocks all paths.
  if (!clearance.clear(resting_posture(cell.robot, clearance))) return std::nullopt;
  Place place{centre_m,
              find_candidates(alone, arm, clearance, options, 3 * static_cast<int>(kSides))};
  if (!from_many_sides(place.touches) || is_refused_for(alone, alone.targets.front().id))
    return std::nullopt;
  // Every n-th: the candidates are ordered by direction.
  std::vector<Candidate> some;
  for (std::size_t k = 0; k < kSides; ++k)
    some.push_back(place.touches[k * place.touches.size() / kSides]);
  place.touches = std::move(some);
  return place;
}

std::vector<Place> possible_places(const Cell& cell, const ArmModel& arm,
                                   const PlanOptions& options) {
  AccuracyRegion region = options.region;
  if (region.kind == AccuracyRegion::Kind::kBox) {
    region.low_m.array() -= kAroundBoxM;
    region.high_m.array() += kAroundBoxM;
  }
  const auto postures =
      accuracy_region_postures(region, arm, {}, {}, options.limit_margin_rad, kPostures);
  const Vector3d up = up_of(cell.robot);
  const double highest_m = std::max(cell.floor_m.value_or(0.0), 0.0) + kHighestM;
  std::vector<Place> places;
  for (const JointVector& posture : postures) {
    poll_cancelled();
    if (places.size() == kMostPlaces) break;
    const Vector3d tip = arm.nominal_tcp(posture).translation();
    const Vector3d centre_m = (tip / kGridM).array().round().matrix() * kGridM;
    if (centre_m.dot(up) > highest_m) continue;
    if (std::ranges::any_of(
            places, [&](const Place& one) { return (one.centre_m - centre_m).norm() < kApartM; }))
      continue;
    if (auto place = place_at(cell, arm, options, centre_m)) places.push_back(std::move(*place));
  }
  return places;
}

/// Choice of the set of places that reduces the uncertainty over the region most.
class PlaceChoice {
 public:
  PlaceChoice(const Cell& cell, const std::vector<Place>& places, const AccuracyRegion& region)
      : places_(places.size()), design_(design_of(cell, places, region)) {}

  std::vector<std::size_t> best(std::size_t count) const {
    std::vector<std::size_t> chosen;
    for (std::size_t n = 0; n < count; ++n) {
      chosen.push_back(places_);
      replace(chosen, n, -1.0);
    }
    for (int round = 0; round < kExchangeRounds; ++round) {
      bool changed = false;
      for (std::size_t n = 0; n < count; ++n)
        changed = replace(chosen, n, (1.0 + kPaysShare) * worth(chosen)) || changed;
      if (!changed) break;
    }
    return chosen;
  }

 private:
  static Design design_of(const Cell& cell, const std::vector<Place>& places,
                          const AccuracyRegion& region) {
    std::vector<Vector3d> centres_m;
    std::vector<Candidate> candidates;
    for (const Place& place : places) {
      for (Candidate c : place.touches) {
        c.target = centres_m.size();
        candidates.push_back(std::move(c));
      }
      centres_m.push_back(place.centre_m);
    }
    DesignProblem problem = design_problem(with_spheres(cell, centres_m), candidates, region);
    return {std::move(problem.rows), std::move(problem.covariance_u), problem.moves_m};
  }

  /// Variance reduction over the region by touches of these places [m^2].
  double worth(const std::vector<std::size_t>& places) const {
    Design design = design_;
    double sum = 0.0;
    for (const std::size_t place : places)
      for (std::size_t k = place * kSides; k < (place + 1) * kSides; ++k) {
        sum += design.gain(static_cast<Eigen::Index>(k));
        design.take(static_cast<Eigen::Index>(k));
      }
    return sum;
  }

  /// Replaces the n-th place by the best one if the set's value then exceeds `more_than`.
  bool replace(std::vector<std::size_t>& chosen, std::size_t n, double more_than) const {
    std::vector<std::size_t> trial = chosen;
    bool better = false;
    for (std::size_t place = 0; place < places_; ++place) {
      if (std::ranges::find(chosen, place) != chosen.end()) continue;
      trial[n] = place;
      if (const double value = worth(trial); value > more_than) {
        more_than = value;
        chosen[n] = place;
        better = true;
      }
    }
    return better;
  }

  std::size_t places_;
  Design design_;
};

}  // namespace

Plan make_plan(const Cell& cell, const PlanOptions& stated, const JointVector& from) {
  if (!cell.robot.positioner.empty()) return make_positioner_plan(cell, stated, from);
  const PlanOptions options = with_tolerances(stated, cell);
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
  if (const auto what = pool.clearance().hit(start))
    throw PlanError(
        PlanError::Kind::kArmStands,
        fmt::format("the arm is too close to something to start: {}. Jog it free", words(*what)));
  Plan plan = visit(cell, options, pool.clearance(), pool.router(), std::move(todo), start);
  foresee(choice, options, plan);
  for (const Target& target : cell.targets)
    if (!is_planned(target, kKinds)) plan.left_out.push_back(target.id);
  return plan;
}

Plan resume_plan(const Cell& cell, const Plan& plan, std::size_t next, const JointVector& from,
                 bool in_contact, const std::vector<double>& positioner_rad) {
  if (next >= plan.touches.size()) return plan;
  if (!cell.robot.positioner.empty())
    return resume_with_positioner(cell, plan, next, {from, in_contact}, positioner_rad);
  const ArmModel arm = planning_arm(cell);
  const Clearance clearance(cell, arm);
  Plan result = plan;
  result.touches[next] = resumed_touch(cell, arm, clearance, resting_posture(cell.robot, clearance),
                                       plan.touches[next], plan.touches[next > 0 ? next - 1 : next],
                                       {from, in_contact});
  return result;
}

SuggestedSpheres suggest_spheres(const Cell& cell, const PlanOptions& options, int count) {
  require_any_turn(cell.robot);
  refuse_external_axes(cell.robot, "suggesting places of spheres",
                       "Place them by hand, and let 'cellcal plan' state the accuracy");
  if (options.region.kind != AccuracyRegion::Kind::kWorkspace &&
      options.region.kind != AccuracyRegion::Kind::kBox)
    throw PlanError(
        PlanError::Kind::kRequest,
        "places are suggested for a region that does not depend on them. Use workspace or "
        "box:X,Y,Z,X,Y,Z");
  refuse_faulty(with_spheres(cell, {}));
  const ArmModel arm = planning_arm(cell);
  std::vector<Place> places = possible_places(cell, arm, options);
  const auto wanted = static_cast<std::size_t>(std::max(count, 1));
  while (places.size() >= wanted) {
    poll_cancelled();
    const std::vector<std::size_t> chosen = PlaceChoice(cell, places, options.region).best(wanted);
    std::vector<Vector3d> centres_m;
    for (const std::size_t place : chosen) centres_m.push_back(places[place].centre_m);
    Cell suggested = with_spheres(cell, centres_m);
    try {
      Plan plan = make_plan(suggested, options);
      return {std::move(suggested), std::move(plan)};
    } catch (const PlanError& error) {
      // Excludes a place without a clear path with the other spheres present.
      if (error.kind == PlanError::Kind::kRequest) throw;
      poll_cancelled();
      const auto blamed = std::ranges::find(suggested.targets, error.target, &Target::id);
      const auto worst = blamed == suggested.targets.end() ? 0 : blamed - suggested.targets.begin();
      places.erase(places.begin() +
                   static_cast<std::ptrdiff_t>(chosen[static_cast<std::size_t>(worst)]));
    }
  }
  throw PlanError(
      PlanError::Kind::kTooFew,
      fmt::format(
          "{} places can be touched from many sides, {} spheres need one each. Remove obstacles, or "
          "choose another region",
          places.size(), wanted));
}

}  // namespace cellcal::calib
