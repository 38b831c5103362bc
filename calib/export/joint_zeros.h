#pragma once
// Zeros and senses in which two descriptions of one arm count their angles: a URDF and the controller's machine
// data. Both have the same axes, in the same base frame, at lengths that may differ.

#include <optional>
#include <vector>

#include "calib/export/rigid_arm.h"

namespace cellcal::calib {

/// other = sense * this + zero.
struct JointZero {
  int sense = 1;
  double zero_rad = 0.0;  ///< -pi to pi
  bool same() const;      ///< within 0.01 deg
};

struct ZeroComparison {
  std::vector<JointZero> joints;
  double flange_rad = 0.0;  ///< rotation between the flanges' frames that no zero explains
  double aside_m = 0.0;     ///< between the axes, all together: other lengths

  bool same() const;
};

/// The explanation with fewest and smallest differences. Empty: the axes are those of different
/// arms.
std::optional<ZeroComparison> compare_zeros(const JointFrames& arm, const JointFrames& other);

}  // namespace cellcal::calib
