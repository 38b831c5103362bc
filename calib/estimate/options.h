#pragma once
// What may be asked of an identification.

#include <optional>

#include "calib/result/level.h"

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
  /// What the model lacks is estimated with the parameters (discrepancy.h), whether or not the
  /// residuals show any. identify() sets it where nothing else explains them.
  bool with_discrepancy = false;
};

}  // namespace cellcal::calib
