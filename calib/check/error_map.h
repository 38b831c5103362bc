#pragma once
// Predicted position error over the arm's reach, as a slice along the first axis: by distance from it and by height.

#include <optional>
#include <vector>

#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Mean over the poses of the workspace (region.h) whose tip is in this square of the slice.
struct ErrorCell {
  double r_m = 0.0, z_m = 0.0;  ///< middle; from the arm's first axis and foot
  int poses = 0;
  /// Mean 3-D error after alignment by a base motion: of this arm with its nominal model, and predicted for the
  /// calibration.
  double nominal_m = 0.0, calibrated_m = 0.0;
};

struct ErrorMap {
  double step_m = 0.0;  ///< edge of a square
  std::vector<ErrorCell> cells;
};

/// Squares with fewer poses are left out.
inline constexpr int kLeastPosesOfCell = 4;
/// Empty without covariance, and for an arm on a linear unit.
std::optional<ErrorMap> error_map(const Calibration& calibration);

}  // namespace cellcal::calib
