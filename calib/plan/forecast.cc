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
  std::vector<Touch> rows;  // one per candidate
  std::vector<JointVector> contacts;
  for (const Candidate& candidate : pool.candidates()) {
    contacts.push_back(candidate.contact);
    Touch touch;
    touch.joint_rad = candidate.contact;
    touch.target = cell.targets[candidate.target].id;
    touch.speed_m_s = estimate.search_speed_m_s();
    rows.push_back(std::move(touch));
  }
  const Problem seen(known.cell(), arm, rows, places, estimate.ripple_rad());
  const Linearisation linear = linearise(seen, estimate.u(), std::vector<bool>(rows.size(), true));
  const Eigen::VectorXd x = estimate.x_si();
  Eigen::VectorXd scale(arm.size());
  for (int i = 0; i < arm.size(); ++i)
    scale[i] = known.unknowns()[static_cast<std::size_t>(i)].scale;
  auto postures = accuracy_region_postures(options.region, arm, contacts, centres,
                                           options.limit_margin_rad, kPostures);
  Eigen::MatrixXd moves = aligned_moves(arm, postures, x.data(), scale);
  const Eigen::Index n = arm.size();
  const double mean_m =
      predicted_mean_error_m(moves, estimate.covariance_u().topLeftCorner(n, n),
                             ripple_variance_m2(arm, postures, estimate.ripple_rad()));
  const PositionBound bound(arm, x, estimate.covariance_si().topLeftCorner(n, n),
                            ripple_elsewhere_rad(estimate.ripple_rad()));
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

}  // namespace cellcal::calib
