#pragma once
// Whether an arm is still the one that was calibrated last.

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/model/joint_vector.h"
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

// In which parameters two calibrations of one cell differ beyond their combined uncertainty.

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

// How far two descriptions of one arm put its tip apart, over the poses that a verdict speaks of.

/// The same nominal geometry: dimensions, senses and the first tool, to a nanometre.
bool same_nominal(const Cell& a, const Cell& b);

/// `count` poses, the same each time: of the workspace, or else within 150 mm of where `touches` were made and
/// in like postures.
std::vector<JointVector> poses_in_scope(const Cell& cell, std::span<const Touch> touches,
                                        bool workspace, int count);

/// Tip in the base frame [m].
using TipOf = std::function<Eigen::Vector3d(const JointVector&)>;
/// Distances of the tips at each pose [m], a motion of the base taken out.
Eigen::VectorXd tips_apart_m(const TipOf& one, const TipOf& other,
                             const std::vector<JointVector>& poses);

/// Over the scope of a calibration: how far an earlier description of the arm was from it, and its own bound.
struct InScope {
  bool workspace = false;
  int poses = 0;
  double mean_apart_m = 0.0, max_apart_m = 0.0;
  double mean_u95_m = 0.0, max_u95_m = 0.0;  ///< of `now`
};

inline constexpr int kScopePoses = 1000;
/// `earlier` null: the nominal arm with a stiff tool. `workspace`: else near the touches, which `now` is of.
/// Empty where their nominal geometry or tool is another, or no poses can be found.
std::optional<InScope> apart_in_scope(const Calibration* earlier, const Calibration& now,
                                      std::span<const Touch> touches, bool workspace);

}  // namespace cellcal::calib
