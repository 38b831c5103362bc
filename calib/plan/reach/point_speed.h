#pragma once
// How fast points of the arm move while the axes go straight from one posture to another: what the
// controller bounds in T1, where the axes' own limits say nothing of it.

#include <span>

#include "calib/model/kinematics.h"

namespace cellcal::calib {

/// Largest speed of a joint's origin (elbow, wrist), the flange or a TCP on the straight line in joint
/// space from `from` to `to` [rad], run at constant speed in one second [m/s]. Nominal arm; within 1 %.
double fastest_point_m_s(const ArmModel& arm, std::span<const double> from,
                         std::span<const double> to);

}  // namespace cellcal::calib
