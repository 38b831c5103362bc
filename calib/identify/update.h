#pragma once
// Update of a calibration from the last one and a few touches since. The last calibration with its
// covariance is the prior; one thing may have changed. The result is a calibration like any other,
// or the reason why a full session is needed.

#include <string>
#include <vector>

#include "calib/estimate/external_axes.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Limits of an update, including the touches of its check; robot time.
inline constexpr int kMostUpdateTouches = 15;
inline constexpr double kMostUpdateS = 40.0;
/// Fewest touches for an update.
inline constexpr std::size_t kLeastUpdateTouches = 6;
/// Largest ratio of the predicted mean error over the workspace to the previous one.
inline constexpr double kUpdateGoal = 1.2;

struct UpdateFacts {
  std::string stands_on;                    ///< the last calibration in words
  double months = 0.0;                      ///< since then
  std::vector<std::string> not_found = {};  ///< targets of which a touch had no contact
  int region_poses = 60;                    ///< as in IdentifyOptions
};

/// Mean over all explanations. Published if it is as good as the last calibration and explained by
/// a single change; otherwise withheld, with the outcome in `update` and among the findings. Throws
/// IdentifyError if `last` has no covariance, or for a touch of a target that is no sphere or is
/// not calibrated.
Calibration update(const Calibration& last, const std::vector<Touch>& touches,
                   const UpdateFacts& facts);

/// True if further touches are worthwhile; false if those so far show no change.
bool further_touches_pay(const UpdateOrigin& so_far);

/// Motion of the tip per parameter of the arm in the frame that a positioner's axes carry, after
/// alignment: 3 rows per pose, none for fewer than three.
Eigen::MatrixXd carried_moves(const Calibration& c, const std::vector<CarriedPose>& poses);
/// Poses of work on all axes of a positioner; none without one.
std::vector<CarriedPose> stated_on_positioner(const Calibration& c, int count);

}  // namespace cellcal::calib
