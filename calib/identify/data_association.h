#pragma once
// Touches under the wrong target's name. A few of them fall out as outliers that lie on another
// target (named_outliers.h); where all of a target's do, or nearly all touches are mixed up, it shows in
// where the nominal arm sees them.

#include <cstddef>
#include <optional>
#include <vector>

#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/result/finding.h"

namespace cellcal::calib {

/// Whole targets whose names have been mixed up: for each of the cell's the one that its touches
/// are really of.
struct Names {
  explicit Names(const Cell& cell);  ///< as they are
  std::vector<std::size_t> of;
  std::size_t changed() const;
  std::vector<Touch> given_to(const Cell& cell, std::vector<Touch> touches) const;
  /// kTargetNames
  Finding cause(const Cell& cell) const;
};
/// Those that bring certified lengths and stated centres nearest to where the nominal arm sees
/// them, by far; of those that do about as well the one that changes the fewest. None where there
/// is no such one, or where the names are as good as others. Of three to seven targets that have a
/// centre and touches that tell it.
std::optional<Names> better_names(const Cell& cell, const std::vector<Touch>& touches);

/// Targets whose touches the nominal arm sees farther apart than one target's lie, no more than
/// half of them together (kScatteredTouches); none where there are none.
std::optional<Finding> scattered_touches(const Cell& cell, const std::vector<Touch>& touches);

}  // namespace cellcal::calib
