#pragma once
// In which parameters two calibrations of one cell differ beyond their combined uncertainty.

#include <string>
#include <vector>

#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Values are SI and radians; `unit` and `to_unit` as of ParameterResult.
struct MovedParameter {
  std::string name;  ///< as parameter_name() has it
  std::string unit;
  double to_unit = 1.0;
  double before = 0.0, after = 0.0;
  double expanded = 0.0;  ///< of the difference, k = 2
};

struct ParameterDifferences {
  /// By more than twice the root of both variances, the farthest in these first.
  std::vector<MovedParameter> moved;
  std::vector<std::string> only_before, only_after;  ///< what only one has: a target, a level's
};

/// Parameters are the same where their names are: another cell file may list the targets in another order. What the frame
/// decides in either is no difference of the arm.
ParameterDifferences parameter_differences(const Calibration& before, const Calibration& after);

}  // namespace cellcal::calib
