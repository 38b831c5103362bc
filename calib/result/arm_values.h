#pragma once
// The arm's own parameters, in its order, out of a calibration's.

#include <Eigen/Core>

#include "calib/model/kinematics.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Nominal and correction [SI] per parameter of the arm; 0 of what was not estimated.
Eigen::VectorXd arm_values(const ArmModel& arm, const Calibration& calibration);
/// [SI]; empty where the calibration has none.
Eigen::MatrixXd arm_covariance(const ArmModel& arm, const Calibration& calibration);

}  // namespace cellcal::calib
