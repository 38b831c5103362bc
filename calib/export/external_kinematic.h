#pragma once
// A positioner as a KUKA controller's machine data state it: each axis turns about z of its frame in the
// controller's sense ($ETn_TA1KR, $ETn_TA2A1), and $ETn_TFLA3 leads to what the last one carries. KR C2
// machine data, "2 The file $MACHINE.DAT".

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

struct ExternalKinematic {
  std::vector<Eigen::Isometry3d>
      axes;  ///< of the first in the base frame, of the next in the one before
  Eigen::Isometry3d flange = Eigen::Isometry3d::Identity();
};
ExternalKinematic external_kinematic(const std::vector<PositionerAxis>& positioner);

/// Lines of $MACHINE.DAT for the axes as found, with their bounds, and instead of the first the root point
/// that lets $ETn_TA1KR stay as drawn; of a linear unit the turn of the arm's foot, and what machine data lack of it.
/// A comment states the use of each. ASCII, LF. Throws FileError for a robot without either.
std::string external_kinematic_lines(const Calibration& calibration);

}  // namespace cellcal::calib
