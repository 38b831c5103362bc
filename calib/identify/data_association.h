#pragma once
// Touches under a wrong target's name. A few of them are outliers that lie on another target
// (calib/verdict/residuals.h); if all of a target's touches or nearly all touches are affected, the
// positions seen by the nominal arm show it.

#include <cstddef>
#include <optional>
#include <vector>

#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/result/finding.h"

namespace cellcal::calib {

/// Permutation of whole targets' names: the actual target of the touches of each target of the
/// cell.
struct Names {
  explicit Names(const Cell& cell);  ///< identity
  std::vector<std::size_t> of;
  std::size_t changed() const;
  std::vector<Touch> given_to(const Cell& cell, std::vector<Touch> touches) const;
  /// kTargetNames
  Finding cause(const Cell& cell) const;
};
/// Permutation for which the positions seen by the nominal arm agree clearly best with certified
/// lengths and stated centres, with the fewest changes among equally good ones. nullopt if there is
/// none, or if the stated names agree as well. For three to seven targets with a centre that their
/// touches determine.
std::optional<Names> better_names(const Cell& cell, const std::vector<Touch>& touches);

/// Finding on targets whose touches, seen by the nominal arm, are too far apart for one target,
/// with at most half of them together (kScatteredTouches); nullopt if there are none.
std::optional<Finding> scattered_touches(const Cell& cell, const std::vector<Touch>& touches);

}  // namespace cellcal::calib
