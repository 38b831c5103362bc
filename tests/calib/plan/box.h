#pragma once
// A box as an obstacle.

#include "calib/model/robot.h"

namespace cellcal::calib::testing {

inline Obstacle box(const char* id, const Eigen::Vector3d& centre_m,
                    const Eigen::Vector3d& size_m) {
  Obstacle o;
  o.id = id;
  o.frame.translation() = centre_m;
  o.size_m = size_m;
  return o;
}

}  // namespace cellcal::calib::testing
