#pragma once
// Correlations of the parameters once the frame directions are taken out. Left in, they would make
// every target coordinate correlate with the first axis and hide the pairs that matter.

#include <cstddef>
#include <vector>

#include "calib/identify/calibration.h"

namespace cellcal::daemon::report {

struct CorrelatedPair {
  std::size_t first = 0, second = 0;  ///< indices into Calibration::parameters
  double correlation = 0.0;
};

struct Correlations {
  bool available = false;             ///< a covariance of the right size with finite entries
  bool frame_removed = false;         ///< the frame directions were taken out
  std::vector<CorrelatedPair> pairs;  ///< |correlation| >= least, strongest first
};

Correlations strong_correlations(const calib::Calibration& calibration, double least);

}  // namespace cellcal::daemon::report
