#include "calib/plan/choice/remaining_uncertainty.h"

#include "calib/problem/solve.h"
#include "calib/uncertainty/bound.h"
#include "calib/uncertainty/region.h"

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
  std::vector<Touch> rows;  // one for each candidate
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
  const auto postures = accuracy_region_postures(options.region, arm, contacts, centres,
                                                 options.limit_margin_rad, kPostures);
  Eigen::MatrixXd moves = aligned_moves(arm, postures, x.data(), scale);
  const Eigen::Index n = arm.size();
  const double mean_m =
      predicted_mean_error_m(moves, estimate.covariance_u().topLeftCorner(n, n),
                             ripple_variance_m2(arm, postures, estimate.ripple_rad()));
  const PositionBound bound(arm, x, estimate.covariance_si().topLeftCorner(n, n),
                            estimate.ripple_rad());
  Design design(linear.jacobian.topRows(linear.length_row), estimate.covariance_u(), moves);
  return {std::move(design), std::move(moves), mean_m, bound.mean_u95_m(postures)};
}

}  // namespace cellcal::calib
