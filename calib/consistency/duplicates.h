#pragma once
// Touches that were not made but copied: a file that was read or pasted twice. Each would count as
// if it had been measured twice, and one that is held out would test the fit against itself.

#include <optional>
#include <span>

#include "calib/model/touch.h"
#include "calib/result/finding.h"

namespace cellcal::calib {

/// Touches that read the same as others of their target, to the last digit; none where they are
/// few, or where no more than repeats that were rounded to the same digits.
std::optional<Finding> duplicate_touches(std::span<const Touch> touches);

}  // namespace cellcal::calib
