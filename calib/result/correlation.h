#pragma once
// Parameters that go together: of such a pair the touches know a combination much better than
// either value. Correlations with the frame directions held; left in, they would make every target
// coordinate correlate with the first axis and hide the pairs that matter.
//
// Worked out from what the calibration holds, wherever it is needed: files, screens and reports
// name the same pairs, whether the calibration comes from identify() or from a file.

#include <cstddef>
#include <vector>

#include "calib/result/calibration.h"

namespace cellcal::calib {

/// |correlation| from which on a pair is worth naming.
constexpr double kStrongCorrelation = 0.9;

struct CorrelatedPair {
  std::size_t first = 0, second = 0;  ///< indices into Calibration::parameters
  double correlation = 0.0;           ///< -1 to 1
};

struct Correlations {
  bool available = false;             ///< a covariance of the right size with finite entries
  bool frame_removed = false;         ///< the frame directions were taken out
  std::vector<CorrelatedPair> pairs;  ///< of arm, tool and touch, strongest first
  /// Further pairs, with a coordinate of a target or with a value that is a matter of the frame:
  /// targets move together with the arm that found them. They say nothing about the robot.
  std::size_t of_targets_or_frame = 0;
};

/// Pairs with |correlation| >= least. Never throws; where nothing can be said it says so.
Correlations strong_correlations(const Calibration& calibration, double least = kStrongCorrelation);

}  // namespace cellcal::calib
