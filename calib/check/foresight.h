#pragma once
// What a calibration foresees of touches of spheres: how far each is off, and how far it may be were
// nothing changed. Everything that a change would do to a touch can be worked out from it.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Arm and sphere at one touch, by the calibration; base frame.
struct ForeseenContact {
  struct Axis {
    Eigen::Vector3d direction, origin;  ///< in the sense in which the controller counts
  };
  std::string target;
  Eigen::Vector3d tip_m;
  Eigen::Matrix3d flange;
  /// Of the tip, where all lengths of the arm grow by one part in one.
  Eigen::Vector3d by_growth_m;
  std::vector<Axis> axes;
  Eigen::Vector3d centre_m;
  double radius_m = 0.0;  ///< at which contact is latched, at this touch's speed
  double offset_m = 0.0;  ///< so far outside of it in earlier checks that held
};

struct Foresight {
  std::vector<ForeseenContact> contacts;
  // Covariances of what the touches are off by, were nothing changed [m^2].
  /// The same whenever they are made: of the calibration, of its gears.
  Eigen::MatrixXd lasting_m2;
  /// Another each time: of the touches' noise, of a usual day's warmth.
  Eigen::MatrixXd passing_m2;
  /// What of the lasting one is beside the calibration's parameters: ripple of the gears, what the model lacks.
  Eigen::MatrixXd beside_m2;
  Eigen::MatrixXd covariance_m2() const { return lasting_m2 + passing_m2; }
};

/// What earlier checks by the same touches, all of which held, say of the next: what was off and lasts is
/// foreseen from then on. `off_m`: of each check a column, as residuals_m() of foresee()'s contacts.
void refer_to(Foresight& foresight, const Eigen::MatrixXd& off_m);

/// Throws IdentifyError where the calibration cannot foresee them: no covariance, a touch of what is no
/// sphere, or of a sphere that it has no place of.
Foresight foresee(const Calibration& calibration, const std::vector<Touch>& touches);
/// The contacts alone.
std::vector<ForeseenContact> foreseen_contacts(const Calibration& calibration,
                                               const std::vector<Touch>& touches);

/// How far outside of where contact is foreseen each tip is [m].
Eigen::VectorXd residuals_m(const std::vector<ForeseenContact>& contacts);

}  // namespace cellcal::calib
