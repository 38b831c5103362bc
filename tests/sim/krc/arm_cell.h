#pragma once
// The KR 5 arc's nominal geometry, for controllers with corrections in space.

#include <numbers>
#include <string>

#include "calib/model/robot.h"

namespace cellcal::sim {

/// Without errors; the flange is the TCP.
inline calib::Cell arm_cell() {
  constexpr double kRadPerDeg = std::numbers::pi / 180.0;
  calib::Cell cell;
  const double d[6] = {0.4, 0, 0, 0.62, 0, 0.115}, a[6] = {0.18, 0.6, 0.12, 0, 0, 0};
  const double alpha[6] = {-90, 0, -90, 90, -90, 0}, offset[6] = {0, 0, -90, 0, 0, 180};
  const int sign[6] = {-1, 1, 1, -1, 1, -1};
  for (int i = 0; i < 6; ++i) {
    calib::Joint joint;
    joint.name = "A" + std::to_string(i + 1);
    joint.sign = sign[i];
    joint.offset_rad = offset[i] * kRadPerDeg;
    joint.d_m = d[i];
    joint.a_m = a[i];
    joint.alpha_rad = alpha[i] * kRadPerDeg;
    joint.min_rad = -185 * kRadPerDeg;
    joint.max_rad = 185 * kRadPerDeg;
    joint.max_speed_rad_s = 154 * kRadPerDeg;
    cell.robot.joints.push_back(joint);
  }
  return cell;
}

}  // namespace cellcal::sim
