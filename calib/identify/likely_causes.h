#pragma once
// Why a calibration did not come out. The mistakes that are made again and again when a cell is set
// up are tried one by one: if the touches suddenly make sense, that is the likely cause. Nothing is
// mended in silence: the verdict stands as it is.

#include <vector>

#include "calib/diagnose/other_robots.h"
#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/result/finding.h"

namespace cellcal::calib {

/// Likely causes (FindingKind::kLikelyCause), likeliest first; empty where none of the usual mistakes explains the touches, or
/// nothing needs to be explained. Tries: angles in radians, an axis that turns the other way or has
/// lost its mastering, two axes' columns exchanged, two targets' ids swapped, another tool or one
/// in metres, one length of the robot file, the file of another robot (of those given), another
/// diameter or tip, a certified length that is wrong or another's, a target that moved on the way.
/// Takes some hundred identifications at worst.
std::vector<Finding> likely_causes(const Cell& cell, const std::vector<Touch>& touches,
                                   const OtherRobots& other_robots = {});

}  // namespace cellcal::calib
