#include "calib/plan/check_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "calib/check/explain.h"
#include "calib/check/foresight.h"
#include "calib/check/mastered.h"
#include "calib/check/tcp_check.h"
#include "calib/estimate/external_axes.h"
#include "calib/estimate/predict.h"
#include "calib/estimate/region.h"
#include "calib/identify/update.h"
#include "calib/model/kinematics.h"
#include "calib/model/linear.h"
#include "calib/model/long_work.h"
#include "calib/plan/aim.h"
#include "calib/plan/candidates.h"
#include "calib/plan/duration.h"
#include "calib/plan/plan.h"
#include "calib/plan/pool.h"
#include "calib/plan/positioner_plan.h"
#include "calib/plan/visit.h"
#include "calib/result/level.h"

namespace cellcal::calib {

namespace {

/// Called for a candidate before it is picked.
using Possible = std::function<bool(std::size_t)>;
/// Picks this many candidates by index.
using ChoiceOfFew = std::function<std::vector<std::size_t>(const std::vector<Candidate>& candidates,
                                                           int count, const Possible& possible)>;

constexpr int kCandidatesForFew = 300;
/// Angles of variations added around the picks: the touches most sensitive to a shift across the tool are at the
/// boundary of the feasible set.
constexpr double kAroundFewRad[] = {0.25, 0.1};
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
    contacts.back().positioner_rad = planned.positioner_rad;
    contacts.back().joint_rad =
        interpolated(planned.standoff, planned.end, planned.expected_m / planned.search_m);
  }
  const Eigen::MatrixXd covariance_m2 = foresee(calibration, contacts).covariance_m2();
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    plan.touches[k].expected_sigma_m = std::sqrt(covariance_m2(i, i));
  }
}

/// The cell with spheres at their calibrated places, and a positioner's axes as found; targets without one are
/// obstacles. Throws PlanError if there is no sphere.
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
  for (std::size_t j = 0; j < cell.robot.positioner.size(); ++j) {
    PositionerAxis& axis = cell.robot.positioner[j];
    axis.frame = axis_as_found(calibration, j);
    axis.place_sigma_m = axis.direction_sigma_rad = axis.scale_sigma = 0.0;
    axis.compliance_sigma_rad_per_nm = axis.bearing_sigma_rad_per_nm = 0.0;
  }
  return cell;
}

/// The cell at fixed angles of the positioner, and its candidates.
struct Still {
  std::vector<double> positioner_rad;  ///< empty: there is none
  Cell cell;                           ///< all places in the base frame
  std::unique_ptr<Pool> pool = {};
};

/// `known`: of as_known().
std::unique_ptr<Still> still_at(const Calibration& calibration, const Cell& known,
                                const std::vector<double>& positioner_rad) {
  auto still = std::make_unique<Still>(positioner_rad, at_setting(known, positioner_rad));
  for (std::size_t t = 0; t < known.targets.size(); ++t) {
    const auto carriers = static_cast<std::size_t>(known.targets[t].carried_by);
    if (carriers > 0)  // with the scale of their angles and what they give, too
      still->cell.targets[t].centre_m =
          carried_as_found(calibration, std::span(positioner_rad).first(carriers),
                           std::span(positioner_rad).subspan(carriers)) *
          known.targets[t].centre_m;
  }
  return still;
}

/// The cell as known, of one with a positioner at the setting asked for, else at the first that lets most
/// spheres be touched. Throws PlanError.
std::unique_ptr<Still> still_cell(const Calibration& calibration, const PlanOptions& options,
                                  const std::vector<double>& asked) {
  const Cell known = as_known(calibration);
  if (known.robot.positioner.empty()) {
    auto still = std::make_unique<Still>(std::vector<double>{}, known);
    still->pool = std::make_unique<Pool>(still->cell, options, kCandidatesForFew);
    return still;
  }
  const JointVector rest = waiting_posture(known);
  std::unique_ptr<Still> best;
  std::size_t least = known.targets.size();
  std::optional<PlanError> why;
  for (const std::vector<double>& angles :
       asked.empty() ? settings_of(known.robot) : std::vector<std::vector<double>>{asked}) {
    std::unique_ptr<Still> still = still_at(calibration, known, angles);
    std::vector<PlanError> refused;
    still->pool =
        pool_of_touchable(still->cell, options, kCandidatesForFew, Kinds::kSpheres, rest, refused);
    if (still->pool == nullptr) {
      if (!why) why = refused.back();
      continue;
    }
    if (refused.size() < least) {
      least = refused.size();
      best = std::move(still);
    }
    if (least == 0) break;
  }
  if (best == nullptr) throw *why;
  return best;
}

/// Candidates, choice, paths and short search lines within a time limit. Throws PlanError.
Plan make_few_touches(const Calibration& calibration, const PlanOptions& options,
                      const CheckPlanOptions& how, const JointVector& from,
                      const ChoiceOfFew& choose) {
  const std::unique_ptr<Still> still = still_cell(calibration, options, how.positioner_rad);
  const Cell& cell = still->cell;
  const Predictor predictor(calibration);
  Pool& pool = *still->pool;
  const JointVector start = from.empty() ? pool.middle() : from;
  if (const auto what = pool.clearance().hit(start))
    throw PlanError(
        PlanError::Kind::kArmStands,
        fmt::format("the arm is too close to something to start: {}. Jog it free", words(*what)));
  const Aim aim = [&](const Candidate& candidate, PlannedTouch& touch) {
    const TargetResult& sphere = *known_sphere(calibration, cell.targets[candidate.target]);
    const Surface surface{cell.targets[candidate.target].centre_m, candidate.normal,
                          sphere.effective_radius_m, [&](const JointVector& q) -> Eigen::Vector3d {
                            return predictor.calibrated(q).tcp.translation();
                          }};
    aim_at(pool, options, surface, {how.before_m, how.behind_m}, candidate, touch);
    touch.may_miss = true;
    touch.positioner_rad = still->positioner_rad;
  };
  Pace pace;
  pace.predicted_m = how.before_m;
  const auto possible = [&](std::size_t candidate) { return pool.connected(candidate); };
  const auto picked_of = [&](int count) {
    std::vector<Candidate> candidates = pool.candidates();
    for (Candidate& one : candidates) one.positioner_rad = still->positioner_rad;
    return choose(candidates, count, possible);
  };
  Random random(options.seed);
  const std::size_t spread = pool.candidates().size();
  for (int count = how.most_touches;; --count) {
    pool.forget(spread, {});
    auto picked = picked_of(count);
    for (const double by_rad : kAroundFewRad) {
      pool.vary(picked, kAroundFew * count, by_rad, random);
      picked = picked_of(count);
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

// Choice of a check's touches: minimises the uncertainty of a shift of the tool, both with everything
// else unchanged and with small changes of everything else.

/// Effect at the tip of all other possible changes.
constexpr double kElseM = 0.1e-3;
/// Prior of a shift of the tool, and of a zero; avoids a singular information matrix for the first touches.
constexpr double kToolM = 1e-3, kZeroRad = 0.02;
/// A shift similar to another change is still detected, but attributed wrongly.
constexpr double kDistinctionWeight = 0.3;
constexpr int kRounds = 3;  ///< of exchange

/// Rows of all candidates, from which those of any set are selected.
class CheckDesign {
 public:
  /// The zeros of these joints; empty: a shift of the tool.
  CheckDesign(const Calibration& calibration, const std::vector<Candidate>& candidates,
              const std::vector<std::string>& joints)
      : prior_(joints.empty() ? kToolM : kZeroRad) {
    const Foresight foresight = foresee(calibration, touches_of(calibration.cell, candidates));
    alone_ = foresight.covariance_m2();
    beside_ = foresight.passing_m2;  // as in checks after earlier ones
    for (const PossibleChange& change : possible_changes(calibration, foresight.contacts)) {
      if (change.kind == ChangeKind::kTouch) continue;
      const Eigen::MatrixXd by = columns_of(change, foresight.contacts);
      if (change.kind == ChangeKind::kTool && joints.empty()) {
        wanted_ = by;
        continue;
      }
      if (change.kind == ChangeKind::kJoint &&
          std::ranges::find(joints, change.name) != joints.end())
        continue;
      const double largest = by.rowwise().squaredNorm().maxCoeff();
      if (!(largest > 0.0)) continue;  // such as an axis that carries no touched sphere
      const double size = kElseM / std::sqrt(largest);
      beside_.noalias() += size * size * by * by.transpose();
    }
    if (!joints.empty()) wanted_ = by_zeros(calibration, joints, foresight.contacts);
  }

  /// Remaining variance of the tool [m^2], or of the zeros [rad^2], under the set.
  double unknown(const std::vector<std::size_t>& set) const {
    return left(set, alone_) + kDistinctionWeight * left(set, beside_);
  }

 private:
  double left(const std::vector<std::size_t>& set, const Eigen::MatrixXd& covariance) const {
    const auto n = static_cast<Eigen::Index>(set.size());
    Eigen::MatrixXd v(n, n), g(n, wanted_.cols());
    for (Eigen::Index a = 0; a < n; ++a) {
      const auto row = static_cast<Eigen::Index>(set[static_cast<std::size_t>(a)]);
      g.row(a) = wanted_.row(row);
      for (Eigen::Index b = 0; b <= a; ++b)
        v(a, b) = covariance(row, static_cast<Eigen::Index>(set[static_cast<std::size_t>(b)]));
    }
    const Eigen::MatrixXd by = Cholesky(v).whitened(g);
    Eigen::MatrixXd information = by.transpose() * by;
    information.diagonal().array() += 1.0 / (prior_ * prior_);
    return Cholesky(information).inverse().trace();
  }

  double prior_;  ///< 1 sigma
  Eigen::MatrixXd alone_, beside_, wanted_;
};

struct Picker {
  const std::vector<Candidate>& candidates;
  const CheckDesign& design;
  const Possible& possible;
  bool every_target;  ///< touches each at least once

  /// The feasible candidate that, with the others, leaves the smallest uncertainty; of a target without touches
  /// among them, if there is one.
  std::optional<std::size_t> best_alternative(const std::vector<std::size_t>& others) const {
    std::set<std::size_t> touched, all;
    for (const Candidate& one : candidates) all.insert(one.target);
    for (const std::size_t c : others) touched.insert(candidates[c].target);
    std::vector<std::pair<double, std::size_t>> by_unknown;
    std::vector<std::size_t> set = others;
    set.push_back(0);
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      poll_cancelled();
      if (std::ranges::find(others, c) != others.end()) continue;
      if (every_target && touched.size() < all.size() && touched.contains(candidates[c].target))
        continue;
      set.back() = c;
      by_unknown.emplace_back(design.unknown(set), c);
    }
    std::ranges::sort(by_unknown);
    for (const auto& [unknown, c] : by_unknown)
      if (possible(c)) return c;
    return std::nullopt;
  }
};

/// One after the other, then exchanged.
std::vector<std::size_t> pick(const Picker& picker, int count) {
  std::vector<std::size_t> picked;
  while (static_cast<int>(picked.size()) < count) {
    const auto next = picker.best_alternative(picked);
    if (!next) return picked;
    picked.push_back(*next);
  }
  for (int round = 0; round < kRounds; ++round)
    for (std::size_t& place : picked) {
      std::vector<std::size_t> others;
      for (const std::size_t& one : picked)
        if (&one != &place) others.push_back(one);
      place = picker.best_alternative(others).value_or(place);
    }
  return picked;
}

/// `count` indices of candidates, with every target at least once if possible; fewer if no more are feasible. Of the
/// zeros of these joints, if any, regardless of targets.
std::vector<std::size_t> choose_check(const Calibration& calibration,
                                      const std::vector<std::string>& joints,
                                      const std::vector<Candidate>& candidates, int count,
                                      const Possible& possible) {
  const CheckDesign design(calibration, candidates, joints);
  return pick({candidates, design, possible, joints.empty()}, count);
}

constexpr int kUpdatePoses = 60;

Eigen::Index place_of(const Calibration& c, const ParameterKey& key) {
  const auto found = std::ranges::find(c.parameters, key, &ParameterResult::key);
  return found == c.parameters.end() ? -1 : found - c.parameters.begin();
}

/// Objective: mean squares of the tip's error over the workspace, also in the frame of what a positioner
/// carries, without base motion, and of every sphere's centre.
Eigen::MatrixXd wanted(const Calibration& c) {
  const ArmModel arm(at_level(c.cell, c.level));
  const Eigen::VectorXd x = arm_values(arm, c);
  const Eigen::MatrixXd moves =
      aligned_moves(arm, workspace_poses(arm, kUpdatePoses, kRegionSeed), x.data()) /
      std::sqrt(static_cast<double>(kUpdatePoses));
  const Eigen::MatrixXd carried = carried_moves(c, stated_on_positioner(c, kUpdatePoses)) /
                                  std::sqrt(static_cast<double>(kUpdatePoses));
  const auto spheres = static_cast<Eigen::Index>(c.targets.size());
  const auto n = static_cast<Eigen::Index>(c.parameters.size());
  const Eigen::Index first = moves.rows() + carried.rows();  // of the spheres
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(first + 3 * spheres, n);
  for (int i = 0; i < arm.size(); ++i)
    if (const Eigen::Index at = place_of(c, arm.parameters()[static_cast<std::size_t>(i)]);
        at >= 0) {
      rows.col(at).head(moves.rows()) = moves.col(i);
      rows.col(at).segment(moves.rows(), carried.rows()) = carried.col(i);
    }
  const double each = 1.0 / std::sqrt(static_cast<double>(std::max<Eigen::Index>(1, spheres)));
  for (Eigen::Index s = 0; s < spheres; ++s)
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t target = c.cell.target_index(c.targets[static_cast<std::size_t>(s)].id);
      const Eigen::Index at = place_of(c, target_parameter(ParameterKind::kCentre, target, axis));
      if (at >= 0) rows(first + 3 * s + axis, at) = each;
    }
  return rows;
}

/// Covariance between the calibration's parameters and the residuals of the touches.
Eigen::MatrixXd across_m(const Calibration& c, const std::vector<Touch>& touches) {
  const KnownTouches known(c, touches);
  const KnownTouches::RowMajor by_unknowns = known.rows(known.x());
  Eigen::MatrixXd rows =
      Eigen::MatrixXd::Zero(by_unknowns.rows(), static_cast<Eigen::Index>(c.parameters.size()));
  for (std::size_t i = 0; i < known.unknowns().size(); ++i)
    if (const Eigen::Index at = place_of(c, known.unknowns()[i].key); at >= 0)
      rows.col(at) = by_unknowns.col(static_cast<Eigen::Index>(i));
  return c.covariance * rows.transpose();
}

// Choice of an update's touches: minimises the remaining uncertainty of the arm over the workspace, and
// of the spheres' centres.

/// `posterior`: mean over all current explanations, with their spread in its covariance. Up to `count` indices
/// of candidates; `possible` is called for each before it is picked.
std::vector<std::size_t> choose_update(const Calibration& posterior,
                                       const std::vector<Candidate>& candidates, int count,
                                       const Possible& possible) {
  const std::vector<Touch> touches = touches_of(posterior.cell, candidates);
  Eigen::MatrixXd foreseen = foresee(posterior, touches).covariance_m2();
  Eigen::MatrixXd cross_covariance = wanted(posterior) * across_m(posterior, touches);
  std::vector<std::size_t> picked;
  while (static_cast<int>(picked.size()) < count) {
    std::vector<std::pair<double, std::size_t>> by_gain;
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      const auto k = static_cast<Eigen::Index>(c);
      by_gain.emplace_back(-cross_covariance.col(k).squaredNorm() / foreseen(k, k), c);  // (84)
    }
    std::ranges::sort(by_gain);
    const auto best = std::ranges::find_if(by_gain, [&](const auto& one) {
      return std::ranges::find(picked, one.second) == picked.end() && possible(one.second);
    });
    if (best == by_gain.end()) return picked;
    picked.push_back(best->second);
    const auto k = static_cast<Eigen::Index>(best->second);
    const Eigen::VectorXd with = foreseen.col(k), cross = cross_covariance.col(k);
    const double variance = foreseen(k, k);
    cross_covariance.noalias() -= cross / variance * with.transpose();  // (84)
    foreseen.noalias() -= with / variance * with.transpose();
  }
  return picked;
}

bool can_be_touched(const Target& target) {
  return target.kind == TargetKind::kSphere && target.has_centre &&
         is_planned(target, Kinds::kSpheresAndPlanes);
}

/// All touches at the first setting of the positioner that lets them. Throws PlanError.
Plan make_still_plan(const Cell& cell, const PlanOptions& options) {
  const JointVector rest = waiting_posture(cell);
  std::optional<PlanError> why;
  for (const std::vector<double>& angles : settings_of(cell.robot)) try {
      Plan plan = make_plan(at_setting(cell, angles), options, rest);
      for (PlannedTouch& touch : plan.touches) touch.positioner_rad = angles;
      return plan;
    } catch (const PlanError& error) {
      if (!why) why = error;
    }
  throw *why;
}

/// The same touch again, from its clear point.
PlannedTouch again(PlannedTouch touch) {
  touch.transit = {touch.standoff};
  touch.corners.clear();
  touch.leaving = {};
  return touch;
}

}  // namespace

Plan make_check_plan(const Calibration& calibration, const PlanOptions& options,
                     const CheckPlanOptions& how, const JointVector& from) {
  return make_few_touches(
      calibration, options, how, from,
      std::bind_front(choose_check, std::cref(calibration), std::cref(how.joints)));
}

CheckPlanOptions mastered_touches(const std::vector<std::string>& joints) {
  CheckPlanOptions how;
  how.most_touches = 6;
  how.least_touches = 4;
  how.before_m = 0.006;
  how.joints = joints;
  return how;
}

PlannedTouch check_touch_from(const Calibration& calibration, const Plan& plan, std::size_t next,
                              const JointVector& from, bool in_contact,
                              const std::vector<double>& positioner_rad) {
  const PlannedTouch& planned = plan.touches.at(next);
  const JointVector& before = next == 0 ? plan.start : plan.touches[next - 1].clear;
  if (!in_contact && from == before && positioner_rad == planned.positioner_rad) return planned;
  // To the stand-off clear of the sphere, then straight on as planned.
  Plan far = plan;
  const bool aimed = planned.transit.size() > 1 && planned.transit.back() == planned.standoff;
  if (aimed) far.touches[next].standoff = planned.transit[planned.transit.size() - 2];
  PlannedTouch touch =
      resume_plan(as_known(calibration), far, next, from, in_contact, positioner_rad).touches[next];
  if (!aimed) return touch;
  touch.standoff = planned.standoff;
  touch.transit.push_back(planned.standoff);
  touch.corners.clear();
  touch.leaving = {};
  return touch;
}

CheckPlanOptions first_update_touches() {
  CheckPlanOptions how;
  how.before_m = 0.006;
  how.most_s = kMostUpdateS / 2.0;
  how.set = TouchSet::kFit;
  return how;
}

CheckPlanOptions further_update_touches(int touches_made, double seconds) {
  CheckPlanOptions how = first_update_touches();
  how.most_touches = kMostUpdateTouches - touches_made;
  how.least_touches = 1;
  how.most_s = kMostUpdateS - seconds;
  return how;
}

Plan make_update_plan(const Calibration& posterior, const PlanOptions& options,
                      const CheckPlanOptions& how, const JointVector& from) {
  return make_few_touches(posterior, options, how, from,
                          std::bind_front(choose_update, std::cref(posterior)));
}

std::string qualification_target(const Cell& cell, std::string_view target) {
  std::string others;
  for (const Target& one : cell.targets) {
    if (!can_be_touched(one)) continue;
    if (target.empty() || one.id == target) return one.id;
    others += (others.empty() ? "" : ", ") + one.id;
  }
  if (target.empty())
    throw PlanError(
        PlanError::Kind::kCell,
        "no sphere with centre_mm: a qualification needs one. Find it with 'cellcal find', or add centre_mm to the cell file");
  throw PlanError(PlanError::Kind::kRequest, std::string(target),
                  fmt::format("target {}: no sphere with centre_mm of that name. There are: {}",
                              target, others.empty() ? "none" : others));
}

Plan make_qualification_plan(const Cell& cell, const PlanOptions& options, std::string_view target,
                             int places, std::span<const double> speeds_m_s) {
  const std::string touched = qualification_target(cell, target);
  Cell one = cell;
  for (Target& other : one.targets) other.obstacle_only = other.id != touched;
  PlanOptions few = options;
  few.fit_touches = places;
  few.check_touches = 0;
  few.criterion = Criterion::kEven;
  const Plan once = cell.robot.positioner.empty() ? make_plan(one, few) : make_still_plan(one, few);
  Plan plan = once;
  plan.touches.clear();
  plan.predicted_mean_m = plan.predicted_u95_m = 0.0;
  for (const PlannedTouch& touch : once.touches)
    for (const double speed : speeds_m_s) {
      const bool first = plan.touches.empty() || plan.touches.back().end != touch.end;
      plan.touches.push_back(first ? touch : again(touch));
      plan.touches.back().search_m_s = speed;
    }
  return plan;
}

}  // namespace cellcal::calib
