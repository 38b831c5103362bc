#pragma once
// Positions of a linear unit from which the arm reaches a place.

#include <Eigen/Core>

#include "calib/model/kinematics.h"
#include "calib/model/linear.h"

namespace cellcal::calib {

/// A random one within the limits reduced by `margin_m`, no farther from the place than the arm with
/// its tool stretched out; the nearest one if none is. 0, without drawing, for an arm without linear
/// unit.
double track_position_m(const ArmModel& arm, const Eigen::Vector3d& place_m, double margin_m,
                        Random& random);

}  // namespace cellcal::calib
