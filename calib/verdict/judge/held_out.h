#pragma once
// Check touches: how far they are off, of what the calibration predicts for them.

#include <cstddef>
#include <span>
#include <vector>

#include "calib/problem/problem.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Of targets with fit touches. None without covariance.
std::vector<HeldOut> held_out(const Problem& problem, const Calibration& calibration);

/// Root of the mean square; 0 of none.
double rms_of(std::span<const HeldOut> touches);

/// Check touches that are gross errors and not the calibration's: few, far off, and without them it
/// does as it predicts. Needs parameters and covariance.
std::vector<std::size_t> gross_check_touches(const Problem& problem,
                                             const Calibration& calibration);

/// Held-out touches may be worse than the calibration predicts for them, but not by this much.
inline constexpr double kCheckRatio = 2.0;

}  // namespace cellcal::calib
