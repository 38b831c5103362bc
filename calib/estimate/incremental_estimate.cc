#include "calib/estimate/incremental_estimate.h"

#include <algorithm>
#include <cmath>

#include "calib/estimate/estimate.h"
#include "calib/estimate/repeats.h"
#include "calib/model/error.h"
#include "calib/result/level.h"

namespace cellcal::calib {

namespace {

/// In prior sigmas, from the point of linearisation: the unknowns are milliradians, so that the
/// next term of the expansion is smaller by a factor of a thousand.
constexpr double kFar = 0.3;
/// Number of touches after which all touches are linearised and tested again.
constexpr std::size_t kTouchesBetween = 10;

void require_finite(const Touch& touch) {
  for (const double angle : touch.joint_rad)
    if (!std::isfinite(angle))
      throw IdentifyError(
          IdentifyError::Kind::kTouches, touch.target,
          "the touch of " + touch.target + " has a joint angle that is not a number; leave it out");
}

}  // namespace

struct IncrementalEstimate::Impl {
  Cell cell;
  Cell levelled;
  ArmModel arm;
  std::vector<Touch> touches;
  std::unique_ptr<Problem> problem;
  Estimate e;
  Eigen::VectorXd at;  ///< point of linearisation of the sums
  std::unique_ptr<LevelSums> sums;
  std::size_t since = 0;  ///< touches since then

  Impl(Cell stated, std::vector<Touch> first)
      : cell(std::move(stated)),
        levelled(at_level(cell, {}, first)),
        arm(levelled),
        touches(std::move(first)) {}

  void from_nothing() {
    problem =
        std::make_unique<Problem>(levelled, arm, touches, starting_places(cell, arm, touches));
    for (std::size_t i = 0; i < touches.size(); ++i)
      if (problem->block_of(i) < 0)
        throw IdentifyError(
            IdentifyError::Kind::kUndetermined, touches[i].target,
            "target " + touches[i].target +
                " has no fit touch; make some of its touches fit touches, or leave it out");
    weigh_repeats(*problem);
    e = estimate(*problem, {}, usual_levels());
    begin_sums();
  }

  void anew() {
    linearise(*problem, e.u, e.use, e.posterior.linear);
    refine(*problem, {}, usual_levels(), e);
    begin_sums();
  }

  /// Sums of the levels that are not negligible.
  void begin_sums() {
    constexpr double kNegligibleProbability = 1e-3;
    std::vector<ModelLevel> counted;
    for (const LevelEvidence& l : e.levels.levels)
      if (l.probability > kNegligibleProbability) counted.push_back(l.level);
    at = e.u;
    sums = std::make_unique<LevelSums>(*problem, at, e.posterior.linear, counted);
    since = 0;
  }
};

IncrementalEstimate::IncrementalEstimate(Cell cell, std::vector<Touch> touches)
    : impl_(make_hidden<Impl>(std::move(cell), std::move(touches))) {
  if (std::none_of(impl_->touches.begin(), impl_->touches.end(),
                   [](const Touch& t) { return t.set == TouchSet::kFit; }))
    throw IdentifyError(IdentifyError::Kind::kUndetermined,
                        "there are no fit touches; nothing to identify from");
  for (const Touch& touch : impl_->touches) require_finite(touch);
  impl_->from_nothing();
}

IncrementalEstimate::Taken IncrementalEstimate::add(const Touch& touch) {
  Impl& me = *impl_;
  require_finite(touch);
  const auto& blocks = me.problem->blocks();
  const std::size_t target = me.cell.target_index(touch.target);
  if (me.problem->lacks_delay_of(touch) ||
      std::none_of(blocks.begin(), blocks.end(),
                   [&](const TargetBlock& block) { return block.target == target; })) {
    std::vector<Touch> more = me.touches;
    more.push_back(touch);
    auto fresh = make_hidden<Impl>(me.cell, std::move(more));
    fresh->from_nothing();
    impl_ = std::move(fresh);
    return {!impl_->e.use.back(), 0.0, true};
  }
  me.arm.prepare(touch.joint_rad);  // throws for a touch of another arm before any change
  me.touches.push_back(touch);
  me.problem->extend(me.touches);
  me.e.use.push_back(false);
  Taken taken;
  if (touch.set != TouchSet::kFit) return taken;

  const std::size_t index = me.touches.size() - 1;
  const Linearisation rows = linearise_touch(*me.problem, me.at, index);
  const Eigen::VectorXd off = rows.residual + rows.jacobian * (me.e.u - me.at);
  for (Eigen::Index k = 0; k < off.size(); ++k) {
    const double variance = 1.0 + rows.jacobian.row(k).dot(me.e.posterior.covariance_u *
                                                           rows.jacobian.row(k).transpose());
    taken.off_sigma = std::max(taken.off_sigma, std::abs(off[k]) / std::sqrt(variance));
  }
  taken.outlier = taken.off_sigma > me.e.gate;
  if (!taken.outlier) {
    me.e.use.back() = true;
    me.sums->add(*me.problem, rows);  // (34)
    LevelMean mean = me.sums->mean();
    me.e.u = mean.u;
    me.e.posterior.covariance_u = std::move(mean.covariance_u);
  }
  ++me.since;
  // The weights of all touches of the place change, and possibly the noise of all touches.
  const bool repeated = repeats_another(me.touches);
  if (repeated) weigh_repeats(*me.problem);
  const double moved = (me.e.u - me.at).lpNorm<Eigen::Infinity>();
  if (repeated || moved > kFar || me.since >= std::max(kTouchesBetween, me.touches.size() / 10)) {
    me.anew();
    taken.anew = true;
    taken.outlier = !me.e.use.back();
  }
  return taken;
}

const Problem& IncrementalEstimate::problem() const { return *impl_->problem; }

Eigen::VectorXd IncrementalEstimate::x_si() const { return impl_->problem->to_si(impl_->e.u); }

Eigen::MatrixXd IncrementalEstimate::covariance_si() const {
  const Eigen::VectorXd scale = impl_->problem->scales();
  return scale.asDiagonal() * impl_->e.posterior.covariance_u * scale.asDiagonal();
}

const Eigen::VectorXd& IncrementalEstimate::u() const { return impl_->e.u; }
const Eigen::MatrixXd& IncrementalEstimate::covariance_u() const {
  return impl_->e.posterior.covariance_u;
}
const LevelMean& IncrementalEstimate::levels() const { return impl_->e.levels; }
double IncrementalEstimate::search_speed_m_s() const {
  const Problem& made = *impl_->problem;
  double fastest_m_s = 0.0;
  for (std::size_t i = 0; i < impl_->touches.size(); ++i)
    if (impl_->touches[i].set == TouchSet::kFit && made.closing_m_s(i) != 0.0)
      fastest_m_s = std::max(fastest_m_s, impl_->touches[i].speed_m_s);
  return fastest_m_s;
}
const std::vector<Touch>& IncrementalEstimate::touches() const { return impl_->touches; }
const std::vector<bool>& IncrementalEstimate::in_use() const { return impl_->e.use; }

}  // namespace cellcal::calib
