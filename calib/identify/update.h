#pragma once
// A calibration out of the last one and a few touches since. The last one with its covariance is what is known
// beforehand; one thing may have changed. What comes out is a calibration like any other, or the reason why a
// full session is needed.

#include <string>
#include <vector>

#include "calib/estimate/region.h"
#include "calib/model/joint_vector.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Of an update in all, its check's touches among them; robot time.
inline constexpr int kMostUpdateTouches = 15;
inline constexpr double kMostUpdateS = 40.0;
/// Fewer say nothing.
inline constexpr std::size_t kLeastUpdateTouches = 6;
/// The predicted mean error over the workspace may be so much larger than it was.
inline constexpr double kUpdateGoal = 1.2;

struct UpdateFacts {
  std::string stands_on;                    ///< the last calibration in words
  double months = 0.0;                      ///< since then
  std::vector<std::string> not_found = {};  ///< targets of which a touch met nothing
  int region_poses = 60;                    ///< as IdentifyOptions'
};

/// The mean over all explanations, published where it is as good as the last one was, and by one change alone;
/// otherwise withheld, with the outcome in `update` and among the findings. Throws IdentifyError where nothing
/// can be worked out: no covariance, a touch of what is no sphere or of a sphere that was not calibrated.
Calibration update(const Calibration& last, const std::vector<Touch>& touches,
                   const UpdateFacts& facts);

/// Whether further touches should be made: unless those so far say that nothing changed.
bool further_touches_pay(const UpdateOrigin& so_far);

// What an update's outcome means for its calibration: published, or withheld with what was found.

/// `c.update` is filled; replaces the findings.
void judge_update(Calibration& c);

// How far the tip is foreseen to be off by a calibration.

/// Mean 3-D error over the poses, ripple and discrepancy in it; 0 for fewer than three.
double foreseen_error_m(const Calibration& c, const std::vector<JointVector>& poses);
/// This arm's with its nominal model; nothing for fewer than three.
NominalError nominal_error_of(const Calibration& c, const std::vector<JointVector>& poses);
/// Poses of the workspace, and near the targets of a calibration in postures like those of the touches.
std::vector<JointVector> stated_workspace(const Calibration& c, int count);
std::vector<JointVector> stated_near_targets(const Calibration& c,
                                             const std::vector<JointVector>& around, int count);

}  // namespace cellcal::calib
