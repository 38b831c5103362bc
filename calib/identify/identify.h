#pragma once
// Identification: maximum a posteriori estimate of geometric errors, tool bending, effective radius
// and target positions from touches, with covariance, frame directions and verdict. The equation
// numbers in the code refer to the READMEs of the modules; calib/README.md lists symbols and
// equations.

#include <functional>
#include <vector>

#include "calib/estimate/options.h"
#include "calib/model/error.h"
#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

// Robots that the cell file may name by mistake.

/// Reads alternative robots on demand, since reading takes time; empty: none. calib/files/robot_file.h
/// provides the shipped ones.
using OtherRobots = std::function<std::vector<NamedRobot>()>;

/// Identifies the calibration. A result that must not be used has verdict.publish() == false and
/// findings on the likely cause among the usual mistakes, if one explains it (likely_causes()). If
/// the touches lead to no calibration, returns the nominal arm, withheld as 'not identified'.
/// Throws IdentifyError if the cell has nothing to identify or there are no usable touches.
Calibration identify(const Cell& cell, const std::vector<Touch>& touches,
                     const IdentifyOptions& options = {}, const OtherRobots& other_robots = {});

/// Likely causes (FindingKind::kLikelyCause), likeliest first; empty if no usual mistake explains
/// the touches, or if they are consistent. Tries those of calib/result/likely_cause.h; takes some
/// hundred identifications in the worst case.
std::vector<Finding> likely_causes(const Cell& cell, const std::vector<Touch>& touches,
                                   const OtherRobots& other_robots = {});

}  // namespace cellcal::calib
