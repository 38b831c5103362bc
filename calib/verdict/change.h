#pragma once
// Whether an arm is still the one that was calibrated last.

#include <optional>
#include <span>
#include <string>

#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// How far two calibrations of one arm lie apart, a motion of the base aside.
struct Change {
  bool workspace = false;  ///< over the workspace; else near the targets
  double mean_m = 0.0;     ///< of the distance between the two tips of a pose
  /// Mean error of the one and of the other there, as their covariances foresee it (the ripple of
  /// the gears is the same in both); root of the sum of squares.
  double expected_m = 0.0;
};

/// Over the narrower of the two scopes; 'near the targets' is near the places and postures of
/// `touches`, which `now` is of.
/// Empty where they cannot be compared: of another nominal arm or tool, or with too few poses; or
/// where neither foresees an error there.
std::optional<Change> change_since(const Calibration& last, const Calibration& now,
                                   std::span<const Touch> touches);

/// Adds to the verdict of `now` what became of the arm since `last`. Withholds it where the tips
/// lie apart by more than three times what both calibrations state, unless that is `accepted`.
/// `which`: the last calibration in words, "session 12 of 2026-11-20".
void judge_change(const Calibration& last, const std::string& which, bool accepted,
                  std::span<const Touch> touches, Calibration& now);

}  // namespace cellcal::calib
