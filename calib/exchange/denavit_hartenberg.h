#pragma once
// Joint frames as Denavit-Hartenberg parameters (Denavit and Hartenberg 1955), with Hayati's beta
// where an axis is parallel to the next (Hayati 1983).

#include "calib/exchange/joint_frames.h"

namespace cellcal::calib {

/// Same forward kinematics, to rounding. Each joint's z goes the way in which its largest component
/// in the base frame, at angle zero, is positive; `sign` carries the rest. Names, limits, speeds and
/// masses as given; errors that may be identified, no tolerances. A joint after which all is fixed
/// keeps the flange where it can; the rest is the robot's fixed flange transform.
Robot robot_of(const JointFrames& frames);

}  // namespace cellcal::calib
