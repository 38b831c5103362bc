#pragma once
// From touches to a calibration: maximum a posteriori estimate of geometric errors, tool bending,
// effective radius and target positions, with covariance, frame directions and verdict.
// The mathematics is in the modules' READMEs, which the code cites by the numbers of equations;
// calib/README.md has the symbols and an index.

#include <functional>
#include <vector>

#include "calib/estimate/options.h"
#include "calib/model/error.h"
#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

// Robots whose file may have been named instead of the right one.

/// Asked for where they are needed, for reading them takes a while; empty: there are none to try.
/// The shipped ones are calib/files' (shipped_robots.h).
using OtherRobots = std::function<std::vector<NamedRobot>()>;

/// A result that must not be used has verdict.publish() == false, and says which of the usual
/// mistakes is the likely cause, where one explains it (likely_causes()). Where the touches lead to
/// no calibration at all it is the nominal arm, withheld as 'not identified'. Throws IdentifyError
/// where there is nothing to identify, or nothing to identify from.
Calibration identify(const Cell& cell, const std::vector<Touch>& touches,
                     const IdentifyOptions& options = {}, const OtherRobots& other_robots = {});

/// Likely causes (FindingKind::kLikelyCause), likeliest first; empty where none of the usual
/// mistakes explains the touches, or nothing needs to be explained. Which ones are tried:
/// calib/result/likely_cause.h. Takes some hundred identifications at worst.
std::vector<Finding> likely_causes(const Cell& cell, const std::vector<Touch>& touches,
                                   const OtherRobots& other_robots = {});

}  // namespace cellcal::calib
