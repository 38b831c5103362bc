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
  /// What the model lacks is estimated with the parameters (discrepancy.h), whether or not the
  /// residuals show any. identify() sets it where nothing else explains them.
  bool with_discrepancy = false;
};

/// A result that must not be used has verdict.publish == false, and says which of the usual
/// mistakes is the likely cause, where one explains it (diagnose.h). Where the touches lead to no
/// calibration at all it is the nominal arm, withheld as 'not identified'. Throws IdentifyError
/// where there is nothing to identify, or nothing to identify from.
Calibration identify(const Cell& cell, const std::vector<Touch>& touches,
                     const IdentifyOptions& options = {});

/// The same without looking for causes; throws IdentifyError also where the touches lead to no
/// calibration.
Calibration identify_as_stated(const Cell& cell, const std::vector<Touch>& touches,
                               const IdentifyOptions& options = {});

/// The nominal arm, withheld for the reason `why`. Throws IdentifyError where identify() does.
Calibration not_identified(const Cell& cell, const std::vector<Touch>& touches,
                           const IdentifyOptions& options, const std::string& why);

/// Throws IdentifyError where there are no fit touches, or an angle is not a number.
void require_sound(const Cell& cell, const std::vector<Touch>& touches);

}  // namespace cellcal::calib
