#include "calib/plan/touch_sequence.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "calib/estimate/predict.h"
#include "calib/estimate/region.h"
#include "calib/identify/identify_once.h"
#include "calib/model/inverse.h"
#include "calib/plan/plan.h"
#include "calib/plan/pool.h"
#include "calib/plan/positioner_plan.h"
#include "calib/plan/route.h"
#include "calib/result/level.h"

namespace cellcal::calib {

namespace {

constexpr int kPosesOfGoal = 150;
constexpr int kTouchesOfGain = 10;  ///< that Goal::worth_it refers to
constexpr int kLeastBatch = 10;

/// A tip farther from every nominal surface is in contact with something else.
constexpr double kNearM = 0.03;

/// Point of the straight move from `from` to `to` nearest to `at`, as a share.
double nearest_share(const JointVector& from, const JointVector& to, const JointVector& at) {
  double along = 0.0, length = 0.0;
  for (std::size_t i = 0; i < at.size(); ++i) {
    along += (at[i] - from[i]) * (to[i] - from[i]);
    length += (to[i] - from[i]) * (to[i] - from[i]);
  }
  return length > 0.0 ? std::clamp(along / length, 0.0, 1.0) : 0.0;
}

bool is_on(const JointVector& from, const JointVector& to, const JointVector& at) {
  if (from.size() != at.size() || to.size() != at.size()) return false;
  const JointVector nearest = interpolated(from, to, nearest_share(from, to, at));
  for (std::size_t i = 0; i < at.size(); ++i)
    if (!(std::abs(at[i] - nearest[i]) <= kOnWayRad)) return false;
  return true;
}

/// True on the search, or on the return from any of its points to the clear point.
bool is_on_search(const SearchUnderWay& left, const JointVector& at) {
  const JointVector& standoff = left.way.back();
  if (is_on(standoff, left.end, at)) return true;
  constexpr int kPlaces = 32;
  for (int k = 0; k <= kPlaces; ++k)
    if (is_on(interpolated(standoff, left.end, static_cast<double>(k) / kPlaces), left.out.front(),
              at))
      return true;
  return false;
}

}  // namespace

struct GoalBatches::Impl {
  Cell cell;
  PlanOptions options;
  Goal goal;
  Plan plan;
  std::size_t at = 0;  ///< next touch of the plan
  std::vector<Touch> touches;
  double last_u95_m = 0.0;
  std::size_t last_count = 0;  ///< fit touches at the last update
  bool checks_planned = false;
  bool only_checks = false;  ///< fit touches of the plan are left out
  Progress progress;

  Impl(const Cell& stated, const PlanOptions& how, const Goal& wanted,
       const std::vector<Touch>& made)
      : cell(stated), options(how), goal(wanted), touches(made) {
    count();
    if (progress.touches == 0)
      plan_first();
    else
      update();
  }

  void count() {
    progress.touches = static_cast<int>(std::ranges::count(touches, TouchSet::kFit, &Touch::set));
    const auto left = [&](TouchSet set) {
      return static_cast<int>(
          std::count_if(plan.touches.begin() + static_cast<std::ptrdiff_t>(at), plan.touches.end(),
                        [set](const PlannedTouch& one) { return one.set == set; }));
    };
    progress.touches_left = left(TouchSet::kFit);
    progress.checks_left = left(TouchSet::kCheck);
    progress.fitted = progress.ended.has_value();
    progress.done = progress.fitted;
  }

  void plan_first() {
    PlanOptions first = options;
    first.fit_touches = goal.most_touches;
    first.goal_u95_m = goal.u95_m;
    checks_planned = true;
    take(make_positioner_plan(cell, first, {}));
  }

  void take(Plan batch) {
    plan = std::move(batch);
    at = 0;
    leave_out();
    count();
  }

  void leave_out() {
    while (only_checks && at < plan.touches.size() && plan.touches[at].set == TouchSet::kFit) ++at;
  }

  /// Check touches that no batch has had yet, in a session that begins with touches made.
  int checks_to_plan() const {
    const auto made = std::ranges::count(touches, TouchSet::kCheck, &Touch::set);
    return checks_planned ? 0 : std::max(0, options.check_touches - static_cast<int>(made));
  }

  /// Postures of the region, for the touched targets' places in the base frame.
  std::vector<JointVector> postures(const ArmModel& arm) const {
    std::vector<JointVector> contacts;
    std::vector<Eigen::Vector3d> tips;
    for (const Touch& touch : touches) {
      contacts.push_back(touch.joint_rad);
      tips.push_back(arm.nominal_tip_m(touch.joint_rad));
    }
    return accuracy_region_postures(options.region, arm, contacts, tips, options.limit_margin_rad,
                                    kPosesOfGoal);
  }

  /// After a batch: the goal is reached, or another batch follows, or none is worth its time.
  void update() {
    const Calibration c = identify_single_pass(cell, touches);
    const ArmModel arm(at_level(c.cell, c.level));
    const Eigen::VectorXd x = arm_values(arm, c);
    const Eigen::MatrixXd covariance = arm_covariance(arm, c);
    const std::vector<JointVector> poses = postures(arm);
    const PositionBound bound(arm, x, covariance, ripple_elsewhere_rad(c), c.discrepancy.sigma_m);
    const Eigen::MatrixXd moves = aligned_moves(arm, poses, x.data());
    progress.u95_m = bound.mean_u95_m(poses);
    progress.mean_m = predicted_mean_error_m(moves, covariance,
                                             ripple_variance_m2(arm, poses, c.level.ripple_rad));
    if (const auto why = end()) {
      only_checks = checks_to_plan() > 0;
      if (only_checks) return plan_next();
      progress.ended = *why;
      if (*why != Ended::kGoal) progress.missing = missing(c, arm, poses, moves);
      return count();
    }
    last_u95_m = progress.u95_m;
    last_count = static_cast<std::size_t>(progress.touches);
    plan_next();
  }

  std::optional<Ended> end() const {
    if (progress.u95_m <= goal.u95_m) return Ended::kGoal;
    if (progress.touches >= goal.most_touches) return Ended::kMostTouches;
    if (last_count == 0) return std::nullopt;
    const double more =
        std::max(1.0, static_cast<double>(progress.touches) - static_cast<double>(last_count));
    const double gain = 1.0 - std::pow(progress.u95_m / last_u95_m, kTouchesOfGain / more);
    return gain < goal.worth_it ? std::optional(Ended::kNoGain) : std::nullopt;
  }

  void plan_next() {
    const auto made = static_cast<std::size_t>(progress.touches);
    const double needed =
        touches_to_goal(made, progress.u95_m / kBoundOverError, goal.u95_m) - progress.touches;
    PlanOptions more = options;
    more.seed = options.seed + static_cast<unsigned>(made);
    more.check_touches = checks_to_plan();
    checks_planned = true;
    const int most = only_checks ? 1 : goal.most_touches - progress.touches;
    more.fit_touches = std::min(
        most, std::max(kLeastBatch, static_cast<int>(std::min(std::ceil(needed), 1.0 * most))));
    take(make_positioner_plan(cell, more, plan.start));
  }

  Missing missing(const Calibration& c, const ArmModel& arm, const std::vector<JointVector>& poses,
                  const Eigen::MatrixXd& moves) const {
    std::vector<ParameterKey> keys;
    Eigen::VectorXd prior_weight(arm.size());
    for (const ArmParameter& parameter : arm.parameters()) {
      prior_weight[static_cast<Eigen::Index>(keys.size())] = 1.0 / parameter.sigma;
      keys.push_back(parameter);
    }
    return largest_part(
        arm, {poses, moves, arm_covariance(arm, c), keys, prior_weight, c.level.ripple_rad});
  }

  void go_on() {
    ++at;
    leave_out();
    count();
    if (at == plan.touches.size() && !progress.done) update();
  }
};

GoalBatches::GoalBatches(const Cell& cell, const PlanOptions& options, const Goal& goal,
                         const std::vector<Touch>& made)
    : impl_(make_hidden<Impl>(cell, options, goal, made)) {}

std::optional<PlannedTouch> GoalBatches::next(const JointVector& from, bool in_contact,
                                              const std::vector<double>& positioner_rad) {
  const Impl& me = *impl_;
  if (me.progress.done) return std::nullopt;
  const PlannedTouch& planned = me.plan.touches[me.at];
  const PlannedTouch* before = me.at > 0 ? &me.plan.touches[me.at - 1] : nullptr;
  if (!in_contact && before != nullptr && before->clear == from &&
      before->positioner_rad == positioner_rad)
    return planned;
  return resume_plan(me.cell, me.plan, me.at, from, in_contact, positioner_rad).touches[me.at];
}

void GoalBatches::touched(const Touch& touch) {
  impl_->touches.push_back(touch);
  impl_->go_on();
}

void GoalBatches::failed() { impl_->go_on(); }

std::vector<JointVector> GoalBatches::way_home(const JointVector& from) const {
  const Plan& plan = impl_->plan;
  const bool behind = !plan.touches.empty() && is_at(plan.touches.back().clear, from);
  return behind ? plan.home : std::vector<JointVector>{};
}

const Progress& GoalBatches::progress() const { return impl_->progress; }

struct TouchSequence::Impl {
  Impl(const Cell& cell, const TouchSequenceOptions& how, const std::vector<Touch>& touches)
      : options(how),
        stated(cell),
        arm(planning_arm(stated)),
        finder(stated, how.plan, how.find, touches),
        made(touches) {
    progress.touches = static_cast<int>(made.size());
    progress.checks_left = how.only_find ? 0 : how.plan.check_touches;
    check_finder();
    if (finder.done() && !how.only_find) begin();
  }

  void check_finder() {
    progress.finding = !finder.done();
    progress.done = options.only_find && finder.done();
    const int most = options.only_find ? 0 : options.goal.most_touches - progress.touches;
    progress.touches_left = std::max(most, finder.touches_left());
  }

  bool found() const { return online || batches; }

  /// Called once all spheres are found.
  void begin() {
    if (stated.robot.positioner.empty())
      online.emplace(finder.located(), options.plan, options.goal, made);
    else
      batches.emplace(finder.located(), options.plan, options.goal, made);
  }

  /// Found and missed places are of the setting that they were searched at.
  void turned_to(const std::vector<double>& angles) {
    positioner_rad = resting_at(stated.robot, angles);
    if (finder.done() || stands_at(finder.positioner_rad(), angles)) return;
    finder = Finder(stated, options.plan, options.find, made, angles);
  }

  std::optional<PlannedTouch> next(const JointVector& from, bool in_contact = false) {
    if (!found()) {
      if (auto touch = finder.next(from)) {
        touch->positioner_rad = positioner_rad;
        return touch;
      }
      if (options.only_find) return std::nullopt;
      begin();
    }
    return batches ? batches->next(from, in_contact, positioner_rad) : online->next(from);
  }

  /// The next touch after this way from where the arm is.
  std::optional<PlannedTouch> next_after(const std::vector<JointVector>& way) {
    auto touch = next(way.back());
    if (!touch) return touch;
    std::vector<JointVector>& first = touch->wait.empty() ? touch->transit : touch->wait;
    first.insert(first.begin(), way.begin(), way.end());
    return touch;
  }

  /// Signed distance of the tip from the target's surface, and the surface's outward normal there.
  static std::pair<double, Eigen::Vector3d> surface(const Cell& cell, const Target& target,
                                                    const Eigen::Vector3d& tip) {
    const Eigen::Vector3d from_centre = tip - target.centre_m;
    if (target.kind == TargetKind::kSphere)
      return {from_centre.norm() - target.diameter_m / 2.0 - cell.tool.tip_radius_m,
              from_centre.normalized()};
    const double above = target.normal.dot(from_centre);
    const double aside =
        std::max(0.0, (from_centre - above * target.normal).norm() - target.extent_m / 2.0);
    const double off = above - cell.tool.tip_radius_m;
    return {aside > 0.0 ? std::hypot(off, aside) : off, target.normal};
  }

  /// Retreat from a search left by the preceding session, by its recorded moves; empty if the arm is
  /// not on them, or need not retreat.
  std::optional<std::vector<JointVector>> recorded_retreat(const JointVector& from,
                                                           bool in_contact) const {
    if (!options.left || finder.done()) return std::nullopt;
    auto way = way_out_of(*options.left, with_positioner(from), in_contact);
    if (!way || (!in_contact && finder.is_clear_at(from))) return std::nullopt;
    for (JointVector& waypoint : *way) waypoint.resize(from.size());
    if (!finder.is_clear_except_sought(from, *way)) return std::nullopt;
    return way;
  }

  JointVector with_positioner(JointVector arm_rad) const {
    arm_rad.insert(arm_rad.end(), finder.positioner_rad().begin(), finder.positioner_rad().end());
    return arm_rad;
  }

  /// Straight away from the sphere or plane at the tip, which may be outside where it is stated.
  JointVector way_out(const JointVector& from) const {
    const Cell& cell = finder.here();
    const Clearance clearance(cell, arm);
    const Eigen::Isometry3d pose = arm.nominal_tcp(from);
    double nearest_m = std::numeric_limits<double>::max();
    Eigen::Vector3d outwards = Eigen::Vector3d::UnitZ();
    std::size_t nearest = 0;
    for (std::size_t t = 0; t < cell.targets.size(); ++t) {
      const Target& target = cell.targets[t];
      if (!is_planned(target, Kinds::kSpheresAndPlanes) || !target.has_centre) continue;
      const auto [off_m, normal] = surface(cell, target, pose.translation());
      if (std::abs(off_m) >= std::abs(nearest_m)) continue;
      nearest_m = off_m;
      outwards = normal;
      nearest = t;
    }
    if (std::abs(nearest_m) > kNearM)
      throw PlanError(PlanError::Kind::kArmStands,
                      fmt::format("the arm is not at a target, and at its position {}. Jog it free",
                                  words_or(clearance.hit(from), "the tip is in contact")));
    if (finder.seeking() == nearest)
      throw PlanError(
          PlanError::Kind::kArmStands, cell.targets[nearest].id,
          fmt::format("the arm is where sphere {} may be, and that place is not known well enough "
                      "to back off. Jog it free",
                      cell.targets[nearest].id));
    Eigen::Isometry3d outside = pose;
    outside.translation() += (options.plan.clear_m + std::max(0.0, -nearest_m)) * outwards;
    const auto out = inverse(arm, outside, from, 0.0);
    if (!out || !clearance.clear_search(from, *out, nearest))
      throw PlanError(
          PlanError::Kind::kArmStands, cell.targets[nearest].id,
          fmt::format(
              "no clear way straight away from target {}, where the tip is. Jog the arm free",
              cell.targets[nearest].id));
    return *out;
  }

  TouchSequenceOptions options;
  Cell stated;
  ArmModel arm;
  Finder finder;
  std::vector<Touch> made;
  std::vector<double> positioner_rad;
  std::optional<Online> online;
  std::optional<GoalBatches> batches;  ///< with a positioner
  Progress progress;                   ///< before online touches begin
};

TouchSequence::TouchSequence(const Cell& cell, const TouchSequenceOptions& options,
                             const std::vector<Touch>& made)
    : impl_(make_hidden<Impl>(cell, options, made)) {}

std::optional<PlannedTouch> TouchSequence::next(const JointVector& from, bool in_contact,
                                                const std::vector<double>& positioner_rad) {
  Impl& me = *impl_;
  me.turned_to(positioner_rad);
  if (me.batches) return me.next(from, in_contact);
  if (const auto out = me.recorded_retreat(from, in_contact)) return me.next_after(*out);
  const bool free = !in_contact && Clearance(me.finder.here(), me.arm).clear(from);
  if (free || me.finder.leads_out(from)) return me.next(from);
  return me.next_after({me.way_out(from)});
}

void TouchSequence::touched(const Touch& touch) {
  Impl& me = *impl_;
  if (me.online) return me.online->touched(touch);
  if (me.batches) return me.batches->touched(touch);
  me.made.push_back(touch);
  ++me.progress.touches;
  me.finder.touched(touch);
  me.check_finder();
}

void TouchSequence::failed(NotMade how) {
  Impl& me = *impl_;
  if (me.online) return me.online->failed();
  if (me.batches) return me.batches->failed();
  if (how == NotMade::kMissed)
    me.finder.missed();
  else
    me.finder.failed();
  me.check_finder();
}

std::vector<JointVector> TouchSequence::way_home(const JointVector& from) const {
  if (impl_->batches) return impl_->batches->way_home(from);
  return impl_->online ? impl_->online->way_home(from) : impl_->finder.way_home(from);
}

std::optional<SearchUnderWay> TouchSequence::under_way(
    const JointVector& from, const std::optional<PlannedTouch>& touch) const {
  if (touch ? !touch->may_miss : impl_->found()) return std::nullopt;
  const auto all = [this](std::vector<JointVector> way) {
    for (JointVector& waypoint : way) waypoint = impl_->with_positioner(waypoint);
    return way;
  };
  const std::vector<JointVector> home = all(impl_->finder.way_home(touch ? touch->clear : from));
  SearchUnderWay search;
  const std::vector<JointVector> way = touch ? all(touch->transit) : home;
  if (way.empty()) return std::nullopt;
  search.way = all({from});
  search.way.insert(search.way.end(), way.begin(), way.end());
  if (!touch) return search;
  search.target = touch->target;
  search.end = impl_->with_positioner(touch->end);
  if (home.empty()) return search;
  search.out = all({touch->clear});
  search.out.insert(search.out.end(), home.begin(), home.end());
  return search;
}

Cell TouchSequence::located() const { return impl_->finder.located(); }

const Progress& TouchSequence::progress() const {
  if (impl_->batches) return impl_->batches->progress();
  return impl_->online ? impl_->online->progress() : impl_->progress;
}

Phrase TouchSequence::stage() const {
  if (progress().finding) return impl_->finder.stage();
  return progress().fitted ? "say.stage.checking" : "say.stage.touching";
}

std::optional<std::vector<JointVector>> way_out_of(const SearchUnderWay& left,
                                                   const JointVector& at, bool in_contact) {
  const bool searches = !left.end.empty();
  if (left.way.empty() || searches == left.out.empty()) return std::nullopt;
  if (searches && left.end.size() == left.way.back().size() && is_on_search(left, at))
    return left.out;
  if (in_contact) return std::nullopt;
  for (std::size_t k = left.way.size() - 1; k > 0; --k) {
    if (!is_on(left.way[k - 1], left.way[k], at)) continue;
    std::vector<JointVector> rest(left.way.begin() + static_cast<std::ptrdiff_t>(k),
                                  left.way.end());
    rest.insert(rest.end(), left.out.begin(), left.out.end());
    return rest;
  }
  return std::nullopt;
}

}  // namespace cellcal::calib
