#pragma once
// The choice of a model level by its evidence: the probability of the touches under the level with
// all its unknowns integrated out over their priors. A level that explains more but has to be
// tuned finely to do so loses. Exact for the linearised problem, and the problem is nearly linear.

#include <vector>

#include "calib/identify/level.h"
#include "calib/identify/problem.h"

namespace cellcal::calib {

/// `problem` at the fullest level without ripple, solved at u. Best first. Never empty.
std::vector<LevelEvidence> weigh_levels(const Problem& problem, const Eigen::VectorXd& u,
                                        const std::vector<bool>& use);

/// The level to use: the best, or among those the touches cannot tell from it the one that claims
/// least.
ModelLevel choose_level(const std::vector<LevelEvidence>& weighed);

}  // namespace cellcal::calib
