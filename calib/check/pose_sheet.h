#pragma once
// Pose accuracy and repeatability in the terms of ISO 9283, from touches of a session: AP, the distance of the mean of
// repeats from the commanded pose, and RP, the mean distance from their own mean plus three of its standard deviations.
//
// A touch measures along its normal alone, so that all distances are of one direction. Commanded is where the
// calibration has the surface at the touched joint angles. It is no test after the standard, which asks for 30 cycles
// over five poses of a cube with all three directions measured.

#include <span>
#include <string>
#include <vector>

#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Held-out touches of one sphere: one pose each, not repeated. Distances along the normals.
struct PoseAccuracy {
  std::string target;
  int poses = 0;
  double mean_m = 0.0, max_m = 0.0;  ///< of AP over the poses
  double predicted_m = 0.0;          ///< mean of AP by the covariance, noise of the touch included
};

/// Touches repeated at one place.
struct PoseRepeatability {
  std::string target;
  std::size_t first = 0;  ///< index of the first of them
  int repeats = 0;
  double mean_m = 0.0;  ///< distance from their mean
  double sigma_m = 0.0;
  double rp_m = 0.0;
  double predicted_m = 0.0;  ///< RP by the noise of a touch
};

struct PoseSheet {
  std::vector<PoseAccuracy> accuracy;            ///< by target, in the order of the cell
  std::vector<PoseRepeatability> repeatability;  ///< in the order of touching
  bool empty() const { return accuracy.empty() && repeatability.empty(); }
};

/// Fewer repeats have no standard deviation worth stating.
inline constexpr int kLeastRepeats = 3;

/// Over the touches of spheres that `left_out` does not name. Empty where the calibration has no covariance.
PoseSheet pose_sheet(const Calibration& calibration, std::span<const Touch> touches,
                     const std::vector<bool>& left_out);

}  // namespace cellcal::calib
