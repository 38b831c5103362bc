#pragma once
// Comparison of an arm with its last calibration.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/model/joint_vector.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Difference of two calibrations of one arm, without a motion of the base.
struct Change {
  bool workspace = false;  ///< over the workspace; otherwise near the targets
  double mean_m = 0.0;     ///< mean distance of the two tips of a pose
  /// Mean errors there predicted by both covariances (the ripple of the gears is common); root of
  /// the sum of squares.
  double expected_m = 0.0;
};

/// Over the narrower of the two scopes; 'near the targets' means near the places and postures of
/// `touches`, which belong to `now`. Empty if they cannot be compared: another nominal arm or tool,
/// too few poses, or no error predicted by either.
std::optional<Change> change_since(const Calibration& last, const Calibration& now,
                                   std::span<const Touch> touches);

/// Adds the change of the arm since `last` to the verdict of `now`. Withholds it if the tips differ
/// by more than three times the stated errors of both calibrations, unless `accepted`. `which`:
/// display text of the last calibration, "session 12 of 2026-11-20".
void judge_change(const Calibration& last, const std::string& which, bool accepted,
                  std::span<const Touch> touches, Calibration& now);

// Parameters of two calibrations of one cell that differ beyond their combined uncertainty.

/// Values in SI and radians; `unit` and `to_unit` as in ParameterResult.
struct MovedParameter {
  std::string name;  ///< as returned by parameter_name()
  std::string unit;
  double to_unit = 1.0;
  double before = 0.0, after = 0.0;
  double expanded = 0.0;  ///< uncertainty of the difference, k = 2
};

struct ParameterDifferences {
  /// By more than twice the root of both variances, in descending order of that ratio.
  std::vector<MovedParameter> moved;
  std::vector<std::string> only_before, only_after;  ///< e.g. a target's, a level's
  /// Determined by the choice of the frame in either: these may differ though the arm has not changed.
  std::vector<std::string> not_compared;
};

/// Parameters are matched by name: another cell file may list the targets in another order.
/// A tool's place that only one identified moved from where the cell file states it.
ParameterDifferences parameter_differences(const Calibration& before, const Calibration& after);

// Distance of the tips of two descriptions of one arm, over the poses of a verdict's scope.

/// Equal nominal geometry: dimensions, senses and the first tool, to a nanometre.
bool same_nominal(const Cell& a, const Cell& b);

/// `count` poses, deterministic: of the workspace, or otherwise within 150 mm of `touches` and in
/// similar postures.
std::vector<JointVector> poses_in_scope(const Cell& cell, std::span<const Touch> touches,
                                        bool workspace, int count);

/// Deviation of an earlier description of the arm from a calibration over its scope, and its own
/// bound.
struct InScope {
  bool workspace = false;
  int poses = 0;
  double mean_apart_m = 0.0, max_apart_m = 0.0;
  double mean_u95_m = 0.0, max_u95_m = 0.0;  ///< of `now`
};

inline constexpr int kScopePoses = 1000;
/// `earlier` null: the nominal arm with a stiff tool. `workspace`: otherwise near the touches,
/// which belong to `now`. Empty if nominal geometry or tool differ, or no poses are found.
std::optional<InScope> apart_in_scope(const Calibration* earlier, const Calibration& now,
                                      std::span<const Touch> touches, bool workspace);

}  // namespace cellcal::calib
