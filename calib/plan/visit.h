#pragma once
// Touches in an order of short duration, with clear paths between them.

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "calib/plan/candidates.h"
#include "calib/plan/route.h"

namespace cellcal::calib {

/// The direct move is clear, but every chain tried is not.
inline constexpr const char* kBlockedAround = "the ways around it are blocked";

struct ToVisit {
  Candidate candidate;
  TouchSet set;
};

/// Shortens the search line of a touch with a known path, if possible.
using Aim = std::function<void(const Candidate&, PlannedTouch&)>;

/// Maximum number of orders evaluated.
inline constexpr int kMostOrders = 24;

/// The fastest evaluated order of `todo`, by planned paths: from `start`, where `leaving` was
/// touched last (null: none).
std::vector<std::size_t> order_by_ways(const Robot& robot, const Router& router,
                                       const std::vector<ToVisit>& todo, const JointVector& start,
                                       const Candidate* leaving, int most_orders = kMostOrders);

/// Visits all of `todo`, from `start` and back. Null `aim`: search lines unchanged. Throws PlanError if no
/// clear path leads to one.
Plan visit(const Cell& cell, const PlanOptions& options, const Clearance& clearance,
           const Router& router, std::vector<ToVisit> todo, const JointVector& start,
           const Aim& aim = {});

// Near-optimal order of visits by duration: an open path from a start.

/// `cost(i, j)`: from i to j, any non-negative times; `from_start[i]`: to i first. Nearest
/// neighbour, then 2-opt and or-opt moves until none improves. Deterministic.
std::vector<std::size_t> short_order(const Eigen::MatrixXd& cost,
                                     const Eigen::VectorXd& from_start);

}  // namespace cellcal::calib
