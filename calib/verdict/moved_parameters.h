#pragma once
// In which parameters two calibrations of one arm differ beyond their combined uncertainty.

#include <vector>

#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Values are SI and radians; `unit` and `to_unit` as of ParameterResult.
struct MovedParameter {
  ParameterKey key;
  std::string unit;
  double to_unit = 1.0;
  double before = 0.0, after = 0.0;
  double expanded = 0.0;  ///< of the difference, k = 2
};

/// Those that differ by more than twice the root of both variances, the farthest in these first. What the frame
/// decides in either is no difference of the arm.
std::vector<MovedParameter> moved_parameters(const Calibration& before, const Calibration& after);

}  // namespace cellcal::calib
