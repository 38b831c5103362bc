#pragma once
// Temperatures that touches state: the model has none, but whoever reads the result should know
// over which range it was made.

#include <optional>
#include <span>

#include "calib/model/touch.h"
#include "calib/result/finding.h"

namespace cellcal::calib {

/// The range, and how many touches state one; none where none does.
std::optional<Finding> temperature_finding(std::span<const Touch> touches);

}  // namespace cellcal::calib
