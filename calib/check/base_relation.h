#pragma once
// Two arms that touched the same spheres: place of the second base in the frame of the first.
//
// Each calibration states the centres in its own base frame with their covariance. The base frame is the one in
// which the calibrated arm is off least over its workspace, so that the relation is that of the two calibrated arms;
// how far each arm itself is off at a pose is not part of it (predict.h). Spheres are taken to be where they were:
// thermal growth of what carries them is not modelled.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <string>
#include <vector>

#include "calib/result/calibration.h"

namespace cellcal::calib {

/// One sphere by its target ids in both calibrations.
struct SpherePair {
  std::string first, second;
};

/// A sphere's centre by the second calibration less that by the first, in the first base frame.
struct RelatedSphere {
  SpherePair sphere;
  bool agrees = true;  ///< false: not used for the relation
  /// The contradiction vanishes without this sphere, of several that the touches cannot tell apart.
  bool suspect = false;
  Eigen::Vector3d off_m = Eigen::Vector3d::Zero();
  double u_m = 0.0;     ///< twice the rms 3-D error of off_m by both covariances
  double sigmas = 0.0;  ///< of off_m, root of its squared Mahalanobis distance
};

struct BaseRelation {
  Eigen::Isometry3d second_in_first = Eigen::Isometry3d::Identity();
  /// Bounds of the second base's origin [m] and rotation vector [rad], along the axes of the first base.
  Eigen::Matrix<double, 6, 6> covariance;
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();  ///< of the used spheres, first base frame
  Eigen::Matrix3d middle_covariance;                   ///< of a point there [m^2]
  double chi2 = 0.0;
  int degrees_of_freedom = 0;
  std::vector<RelatedSphere> spheres;

  /// Every sphere agrees, and none is a suspect.
  bool agrees() const;
};

/// Below this from one line, rms, spheres hold no rotation about it.
inline constexpr double kLeastOffLineM = 0.01;

/// (100), (101). Throws IdentifyError: fewer than three spheres, on one line, of another kind or diameter, without a
/// covariance; LinearUnitError for an arm on a linear unit.
BaseRelation relate_bases(const Calibration& first, const Calibration& second,
                          std::span<const SpherePair> spheres);

}  // namespace cellcal::calib
