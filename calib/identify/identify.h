#pragma once
// From touches to a calibration: maximum a posteriori estimate of geometric errors, tool bending,
// effective radius and target positions, with covariance, frame directions and verdict.
// The mathematics is in calib/README.md, in the order of the method; it can be read beside the
// code.

#include <optional>
#include <vector>

#include "calib/files/error.h"
#include "calib/files/touch.h"
#include "calib/identify/calibration.h"

namespace cellcal::calib {

/// For a result that is kept and read: the method's number.
constexpr int kStatedPoses = 1000;

struct IdentifyOptions {
  /// Touches further off than this many sigma, studentised, are named outliers and left out; more
  /// where all scatter more than stated.
  double outlier_sigma = 4.0;
  bool reject_outliers = true;
  int max_iterations = 100;
  /// Set: this model level; otherwise the mean over all, weighed by the touches' evidence.
  std::optional<ModelLevel> level = std::nullopt;
  /// Of the workspace, and as many near the targets: over these M2 and M3 are predicted. Other
  /// draws of so few differ by 3 %.
  int region_poses = 60;
};

/// Throws IdentifyError when the touches cannot determine a calibration at all. A result that can
/// be computed but must not be used has verdict.publish == false. Either says which of the usual
/// mistakes is the likely cause, where one explains it (diagnose.h).
Calibration identify(const Cell& cell, const std::vector<Touch>& touches,
                     const IdentifyOptions& options = {});

/// The same without looking for causes.
Calibration identify_as_stated(const Cell& cell, const std::vector<Touch>& touches,
                               const IdentifyOptions& options = {});

}  // namespace cellcal::calib
