#pragma once
// Changes of a cell between its calibration and the next touches.

#include <string>

#include "calib/model/linear.h"
#include "calib/result/tcp_check.h"
#include "tests/experiments/world.h"

namespace cellcal::experiments {

struct Happening {
  calib::ChangeKind kind = calib::ChangeKind::kNothing;
  double size = 0.0;  ///< m at the tip or of a sphere; rad of a joint; 1 for growth
};

/// "tool 0.30 mm"
std::string name_of(const Happening& happening);

struct Happened {
  Eigen::Vector3d tool_shift_m = Eigen::Vector3d::Zero();
  std::string which;  ///< sphere or joint
};

/// Random direction, sphere or joint; never the last joint, whose zero is a shift of the tool.
Happened happen(const Happening& happening, World& world, calib::Random& random);

}  // namespace cellcal::experiments
