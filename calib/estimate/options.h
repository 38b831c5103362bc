#pragma once
// Options of an identification.

#include <optional>

#include "calib/result/level.h"

namespace cellcal::calib {

/// Number of region poses of a result that is stored, as the method specifies.
constexpr int kStatedPoses = 1000;

struct IdentifyOptions {
  bool reject_outliers = true;
  /// Model level, if set; otherwise the mean over all levels, weighted by their evidence.
  std::optional<ModelLevel> level = std::nullopt;
  /// Number of random poses in the workspace, and near the targets, over which M2 and M3 are
  /// predicted. Other draws of so few differ by 3 %.
  int region_poses = 60;
  /// Estimates the model discrepancy with the parameters (discrepancy.h), even if the residuals
  /// show none. identify() sets it if nothing else explains the residuals.
  bool with_discrepancy = false;
  /// Functions of the joints' angles where the touches show them; false for comparison only.
  bool functions = true;
};

}  // namespace cellcal::calib
