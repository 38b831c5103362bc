#include "calib/plan/reach/visit.h"

#include <fmt/format.h>

#include "calib/plan/reach/corners.h"
#include "calib/plan/reach/duration.h"
#include "calib/plan/reach/order.h"
#include "calib/plan/reach/pool.h"
#include "calib/plan/reach/reasons.h"

namespace cellcal::calib {

namespace {

/// What changing over costs beyond the direct move: the tip has to rise above a sphere to get round
/// it, and another sphere is farther.
constexpr double kSameSphereS = 0.2, kOtherSphereS = 0.5;

}  // namespace

Plan visit(const Cell& cell, const PlanOptions& options, const Clearance& clearance,
           const Router& router, std::vector<ToVisit> todo, const JointVector& start,
           const Aim& aim) {
  const Pace pace;
  const auto count = static_cast<Eigen::Index>(todo.size());
  Eigen::MatrixXd cost = Eigen::MatrixXd::Zero(count, count);
  Eigen::VectorXd from_start(count);
  for (Eigen::Index j = 0; j < count; ++j) {
    const Candidate& to = todo[static_cast<std::size_t>(j)].candidate;
    from_start[j] = move_s(cell.robot, start, to.standoff, pace);
    for (Eigen::Index i = 0; i < count; ++i) {
      const Candidate& from = todo[static_cast<std::size_t>(i)].candidate;
      cost(i, j) = move_s(cell.robot, from.clear, to.standoff, pace) +
                   (from.target == to.target ? kSameSphereS : kOtherSphereS);
    }
  }
  Plan plan;
  plan.start = start;
  JointVector at = start;
  const Candidate* leaving = nullptr;
  for (const std::size_t next : short_order(cost, from_start)) {
    const Candidate& to = todo[next].candidate;
    auto way = router.to_standoff(at, leaving, to);
    if (!way)
      throw PlanError(
          fmt::format("{}: no clear way to its touch from direction {}: {}. Move it or what is "
                      "in the way, or start from another posture",
                      cell.targets[to.target].id, direction_words(to.normal),
                      words_or(clearance.hit(at, to.standoff, kTipMarginM), kBlockedAround)));
    plan.touches.push_back(to_planned(cell, to, todo[next].set, options));
    plan.touches.back().transit = std::move(*way);
    if (aim) aim(to, plan.touches.back());
    round_corners(clearance, leaving != nullptr ? leaving->end : JointVector{}, at,
                  plan.touches.back());
    leaving = &to;
    at = to.clear;
  }
  if (leaving != nullptr) {
    const auto back = router.away(*leaving, start);
    if (back) plan.home = *back;  // else the arm stays at the clear point, which is free
  }
  return plan;
}

}  // namespace cellcal::calib
