#include "calib/plan/forecast.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "calib/estimate/predict.h"
#include "calib/estimate/region.h"
#include "calib/estimate/solve.h"

namespace cellcal::calib {

namespace {

constexpr int kPostures = 150;

/// Minimum touches of a target before its next contact is predicted. Fewer do not determine its
/// place: with certified lengths they may be consistent with another, and the estimate returns only
/// one.
constexpr std::ptrdiff_t kFewest = 4;
/// Bounds the influence of a single gross touch on later predictions.
constexpr double kMostOff = 10.0;
constexpr double kStepM = 0.001;  ///< step between postures on a search line

/// `like`: a touch with the load held; `speed_m_s`: includes the latch delay in the prediction.
Touch on_line(const PlannedTouch& planned, double travel_m, const Touch& like, double speed_m_s) {
  Touch touch;
  touch.target = planned.target;
  touch.load = like.load;
  touch.positioner_rad = planned.positioner_rad;
  touch.speed_m_s = speed_m_s;
  touch.joint_rad = interpolated(planned.standoff, planned.end, travel_m / planned.search_m);
  return touch;
}

/// Gaps between tip and surface along search lines, under an estimate.
struct Gaps {
  Eigen::VectorXd gap_m, sigma_m;
};

Gaps gaps_at(const IncrementalEstimate& running, const std::vector<Touch>& postures) {
  const Problem& known = running.problem();
  std::vector<TargetPlace> places(known.cell().targets.size());
  for (const TargetBlock& block : known.blocks()) places[block.target] = known.place(block);
  // Appended to the measured touches, so that the unknowns and their order are the same.
  std::vector<Touch> rows = running.touches();
  std::vector<bool> use(rows.size(), false);
  const auto first = static_cast<Eigen::Index>(rows.size());
  rows.insert(rows.end(), postures.begin(), postures.end());
  use.resize(rows.size(), true);
  const Problem seen(known.cell(), known.arm(), rows, places, running.levels().ripple_rad);
  const Linearisation linear = linearise(seen, running.u(), use);
  const auto count = static_cast<Eigen::Index>(postures.size());
  Gaps gaps{Eigen::VectorXd(count), Eigen::VectorXd(count)};
  const auto by_u = linear.jacobian.topRows(count);
  const Eigen::VectorXd unknown =
      (by_u * running.covariance_u()).cwiseProduct(by_u).rowwise().sum();
  for (Eigen::Index k = 0; k < count; ++k) {
    const double sigma_m = seen.sigma_m(static_cast<std::size_t>(first + k));
    gaps.gap_m[k] = linear.residual[k] * sigma_m;
    gaps.sigma_m[k] = sigma_m * std::sqrt(1.0 + unknown[k]);
  }
  return gaps;
}

}  // namespace

RemainingUncertainty remaining_uncertainty(const Cell& cell, const Pool& pool,
                                           const PlanOptions& options,
                                           const IncrementalEstimate& estimate) {
  const Problem& known = estimate.problem();
  const ArmModel& arm = known.arm();
  std::vector<TargetPlace> places(cell.targets.size());
  std::vector<Eigen::Vector3d> centres;
  for (const TargetBlock& block : known.blocks()) {
    places[block.target] = known.place(block);
    centres.push_back(cell.targets[block.target].centre_m);
  }
  std::vector<Touch> rows = touches_of(cell, pool.candidates());
  std::vector<JointVector> contacts;
  for (Touch& touch : rows) {
    contacts.push_back(touch.joint_rad);
    touch.speed_m_s = estimate.search_speed_m_s();
  }
  const Problem seen(known.cell(), arm, rows, places, estimate.levels().ripple_rad);
  const Linearisation linear = linearise(seen, estimate.u(), std::vector<bool>(rows.size(), true));
  const Eigen::VectorXd x = estimate.x_si();
  auto postures = accuracy_region_postures(options.region, arm, contacts, centres,
                                           options.limit_margin_rad, kPostures);
  Eigen::MatrixXd moves = aligned_moves(arm, postures, x.data(), known.scales());
  const Eigen::Index n = arm.size();
  const double mean_m =
      predicted_mean_error_m(moves, estimate.covariance_u().topLeftCorner(n, n),
                             ripple_variance_m2(arm, postures, estimate.levels().ripple_rad));
  const PositionBound bound(arm, x, estimate.covariance_si().topLeftCorner(n, n),
                            ripple_elsewhere_rad(estimate.levels().ripple_rad));
  Design design(linear.jacobian.topRows(linear.length_row), estimate.covariance_u(), moves);
  const double u95_m = bound.mean_u95_m(postures);
  return {std::move(design), std::move(moves), mean_m, u95_m, std::move(postures)};
}

int touches_by_trend(const std::vector<std::pair<int, double>>& bounds, double goal_m, int most) {
  constexpr std::size_t kLeast = 8, kLate = 16;
  const std::size_t count = std::min(kLate, bounds.size());
  if (count < kLeast) return most;
  double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  for (std::size_t k = bounds.size() - count; k < bounds.size(); ++k) {
    const double log_touches = std::log(bounds[k].first), log_u95 = std::log(bounds[k].second);
    n += 1.0;
    x += log_touches;
    y += log_u95;
    xx += log_touches * log_touches;
    xy += log_touches * log_u95;
  }
  const double power = (x * y - n * xy) / (n * xx - x * x);
  constexpr double kStandingStill = 0.1;
  if (!(power > kStandingStill)) return most;
  const auto& [touches, u95_m] = bounds.back();
  const double more = touches * (std::pow(u95_m / goal_m, 1.0 / power) - 1.0);  // (69)
  return static_cast<int>(std::clamp(std::ceil(more), 1.0, static_cast<double>(std::max(1, most))));
}

ContactForecast::ContactForecast(Cell cell) : cell_(std::move(cell)) {
  cell_.lengths.clear();
  for (Target& target : cell_.targets) target.centre_sigma_m = 0.0;
}

void ContactForecast::learn(std::span<const Touch> touches) {
  while (learnt_ < touches.size()) {
    const Touch& touch = touches[learnt_++];
    if (touch.set != TouchSet::kFit) continue;
    fit_.push_back(touch);
    try {
      take(touch);
    } catch (const IdentifyError&) {
      running_.reset();
    } catch (...) {  // interrupted within a touch: of no further use
      running_.reset();
      throw;
    }
  }
}

void ContactForecast::take(const Touch& touch) {
  const std::ptrdiff_t count = made(touch.target);
  if (count < kFewest) return;
  if (count == kFewest || !running_) return begin();
  const IncrementalEstimate::Taken taken = running_->add(touch);
  const double off = std::min(std::abs(taken.off_sigma), kMostOff);
  off_squares_ += off * off;
  ++off_count_;
  // Either this touch or the earlier ones are wrong: the estimate is restarted.
  if (taken.outlier) begin();
}

/// Starts from the touches of those targets that have enough.
void ContactForecast::begin() {
  std::vector<Touch> enough;
  for (const Touch& touch : fit_)
    if (made(touch.target) >= kFewest) enough.push_back(touch);
  running_.reset();
  running_.emplace(cell_, std::move(enough));
}

std::ptrdiff_t ContactForecast::made(const std::string& target) const {
  return std::ranges::count(fit_, target, &Touch::target);
}

/// Scatter of the touches relative to the estimate's expectation; at least 1.
double ContactForecast::misfit() const {
  return off_count_ > 0 ? std::max(1.0, std::sqrt(off_squares_ / off_count_)) : 1.0;
}

std::vector<ExpectedContact> ContactForecast::of(const Plan& plan, std::size_t next) const {
  std::vector<ExpectedContact> expected(plan.touches.size());
  if (!running_) return expected;
  std::vector<std::size_t> which;
  std::vector<Touch> postures;
  const double speed_m_s = running_->search_speed_m_s();
  for (std::size_t k = next; k < plan.touches.size(); ++k) {
    if (made(plan.touches[k].target) < kFewest) continue;
    which.push_back(k);
    for (const double further_m : {0.0, kStepM})
      postures.push_back(
          on_line(plan.touches[k], plan.touches[k].expected_m + further_m, fit_.back(), speed_m_s));
  }
  if (which.empty()) return expected;
  const Gaps nominal = gaps_at(*running_, postures);
  // A sphere is curved: one more step from the first result.
  postures.clear();
  std::vector<double> slope;
  for (std::size_t n = 0; n < which.size(); ++n) {
    const auto k = static_cast<Eigen::Index>(2 * n);
    slope.push_back((nominal.gap_m[k + 1] - nominal.gap_m[k]) / kStepM);
    const PlannedTouch& planned = plan.touches[which[n]];
    expected[which[n]].travel_m = planned.expected_m - nominal.gap_m[k] / slope[n];
    postures.push_back(on_line(planned, expected[which[n]].travel_m, fit_.back(), speed_m_s));
  }
  const Gaps gaps = gaps_at(*running_, postures);
  for (std::size_t n = 0; n < which.size(); ++n) {
    const auto k = static_cast<Eigen::Index>(n);
    ExpectedContact& one = expected[which[n]];
    one.travel_m -= gaps.gap_m[k] / slope[n];  // (73)
    // A lateral gap has a larger effect along the line the less the line points towards the
    // surface.
    one.sigma_m = misfit() * gaps.sigma_m[k] / std::abs(slope[n]);
    const bool sound = std::isfinite(one.travel_m) && std::isfinite(one.sigma_m);
    if (!sound) one = {};
  }
  return expected;
}

}  // namespace cellcal::calib
