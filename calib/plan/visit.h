#pragma once
// Touches in an order that costs the robot little time, with clear ways from one to the next.

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "calib/plan/candidates.h"
#include "calib/plan/route.h"

namespace cellcal::calib {

/// Where the direct move is clear, but every chain that was tried is not.
inline constexpr const char* kBlockedAround = "the ways around it are blocked";

struct ToVisit {
  Candidate candidate;
  TouchSet set;
};

/// Shortens the search line of a touch whose way is known, where it can.
using Aim = std::function<void(const Candidate&, PlannedTouch&)>;

/// Orders that are looked at at most.
inline constexpr int kMostOrders = 24;

/// The order of `todo` that takes the least time of those looked at, by the ways that are found:
/// from `start`, where `leaving` was touched last (null: nothing was).
std::vector<std::size_t> order_by_ways(const Robot& robot, const Router& router,
                                       const std::vector<ToVisit>& todo, const JointVector& start,
                                       const Candidate* leaving, int most_orders = kMostOrders);

/// Visits all of `todo`, from `start` and back. Null `aim`: search lines as they are. Throws PlanError where no
/// clear way leads to one.
Plan visit(const Cell& cell, const PlanOptions& options, const Clearance& clearance,
           const Router& router, std::vector<ToVisit> todo, const JointVector& start,
           const Aim& aim = {});

// The order of visits that costs the robot the least time, near enough: an open path from a start.

/// `cost(i, j)`: from i to j, any non-negative times; `from_start[i]`: to i first. Nearest
/// neighbour, then 2-opt and or-opt moves until none helps. The same for the same costs.
std::vector<std::size_t> short_order(const Eigen::MatrixXd& cost,
                                     const Eigen::VectorXd& from_start);

}  // namespace cellcal::calib
