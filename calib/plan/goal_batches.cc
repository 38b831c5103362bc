#include "calib/plan/goal_batches.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "calib/estimate/predict.h"
#include "calib/estimate/region.h"
#include "calib/identify/identify_once.h"
#include "calib/plan/plan.h"
#include "calib/plan/positioner_plan.h"
#include "calib/result/level.h"

namespace cellcal::calib {

namespace {

constexpr int kPosesOfGoal = 150;
constexpr int kTouchesOfGain = 10;  ///< that Goal::worth_it refers to
constexpr int kLeastBatch = 10;

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
    const Eigen::MatrixXd moves =
        aligned_moves(arm, poses, x.data(), Eigen::VectorXd::Ones(arm.size()));
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
    : impl_(new Impl(cell, options, goal, made)) {}
GoalBatches::~GoalBatches() = default;
GoalBatches::GoalBatches(GoalBatches&&) noexcept = default;
GoalBatches& GoalBatches::operator=(GoalBatches&&) noexcept = default;

std::optional<PlannedTouch> GoalBatches::next(const JointVector& from,
                                              const std::vector<double>& positioner_rad) {
  const Impl& me = *impl_;
  if (me.progress.done) return std::nullopt;
  const PlannedTouch& planned = me.plan.touches[me.at];
  const PlannedTouch* before = me.at > 0 ? &me.plan.touches[me.at - 1] : nullptr;
  if (before != nullptr && before->clear == from && before->positioner_rad == positioner_rad)
    return planned;
  return resume_plan(me.cell, me.plan, me.at, from, positioner_rad).touches[me.at];
}

void GoalBatches::touched(const Touch& touch) {
  impl_->touches.push_back(touch);
  impl_->go_on();
}

void GoalBatches::failed() { impl_->go_on(); }

std::vector<JointVector> GoalBatches::way_home(const JointVector& from) const {
  const Plan& plan = impl_->plan;
  const bool behind = !plan.touches.empty() && plan.touches.back().clear == from;
  return behind ? plan.home : std::vector<JointVector>{};
}

const Progress& GoalBatches::progress() const { return impl_->progress; }

}  // namespace cellcal::calib
