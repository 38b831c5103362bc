#pragma once
// Prediction of touches of spheres by a calibration: residuals and their covariance in an unchanged
// cell, and the geometry from which the effect of any change follows.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Arm and sphere at one touch, as calibrated; in the frame that the sphere is fixed in: the base's, or that
/// of the positioner's axis that carries it.
struct ForeseenContact {
  struct Axis {
    Eigen::Vector3d direction, origin;  ///< sense of rotation as counted by the controller
  };
  std::string target;
  Eigen::Vector3d tip_m;
  Eigen::Matrix3d flange;
  /// Derivative of the tip by a relative growth of all the arm's lengths.
  Eigen::Vector3d by_growth_m;
  /// The arm's, then the positioner's that carry the sphere: as the arm turns, seen from there.
  std::vector<Axis> axes;
  /// Foot of the positioner, for a carried sphere.
  struct Foot {
    Eigen::Matrix3d base;    ///< axes of the base frame
    Eigen::Vector3d origin;  ///< of the first axis
  };
  std::optional<Foot> foot;
  Eigen::Vector3d centre_m;
  double radius_m = 0.0;  ///< at which contact is latched, at this touch's speed
  double offset_m = 0.0;  ///< mean distance outside the surface in earlier checks that held
};

struct Foresight {
  std::vector<ForeseenContact> contacts;
  // Covariances of the touches' residuals in an unchanged cell [m^2].
  /// Common to all repetitions: errors of the calibration and of the gears.
  Eigen::MatrixXd lasting_m2;
  /// Independent in each repetition: noise of the touches and daily temperature variation.
  Eigen::MatrixXd passing_m2;
  /// Part of lasting_m2 not covered by the calibration's parameters: gear ripple and model error.
  Eigen::MatrixXd model_error_m2;
  Eigen::MatrixXd covariance_m2() const { return lasting_m2 + passing_m2; }
};

/// Updates the prediction with earlier checks by the same touches, all of which held: their lasting
/// residuals are expected again. `off_m`: a column per check, as residuals_m() of the foreseen contacts.
void refer_to(Foresight& foresight, const Eigen::MatrixXd& off_m);

/// Throws IdentifyError if the calibration cannot predict the touches: no covariance, a target that is
/// not a sphere, or a sphere whose centre it lacks.
Foresight foresee(const Calibration& calibration, const std::vector<Touch>& touches);
/// Contacts without covariances.
std::vector<ForeseenContact> foreseen_contacts(const Calibration& calibration,
                                               const std::vector<Touch>& touches);

/// Distance of each tip outside the predicted contact [m].
Eigen::VectorXd residuals_m(const std::vector<ForeseenContact>& contacts);

}  // namespace cellcal::calib
