#pragma once
// A dimension of arm or tool that is drawn wrongly by centimetres, or the drawing of another arm,
// puts the nominal tips so far from their targets that an estimate may end anywhere. How far they
// are off is told without one, and quickly: so one dimension after the other is tried.

#include <string>
#include <vector>

#include "calib/diagnose/other_robots.h"
#include "calib/model/robot.h"
#include "calib/model/touch.h"

namespace cellcal::calib {

/// How far the nominal arm is from meeting the fit touches, each target put where they lie best:
/// median [m]; infinite where they do not say where a target is.
double nominal_off_m(const Cell& cell, const std::vector<Touch>& touches);

struct Dimension {
  enum class Of { kD, kA, kToolX, kToolY, kToolZ };
  Of of;
  std::size_t joint = 0;  ///< of d and a
  double& in(Cell& cell) const;
};

/// d and a of all joints that may be off.
std::vector<Dimension> dimensions_of(const Robot& robot);

/// What added to a dimension brings the nominal arm nearest to the touches.
struct Nearest {
  double add_m = 0.0, off_m = 0.0;
};
/// Within 340 mm, to 5 mm.
Nearest nearest(const Cell& cell, const std::vector<Touch>& touches, const Dimension& dimension);

/// Moves the tool's tip to where the nominal arm comes nearest to the touches, by one coordinate
/// after the other. Returns how far it is off then.
double bring_tool_nearest(Cell& cell, const std::vector<Touch>& touches);

struct OtherArm {
  std::string file;  ///< as a cell file names it
  Cell cell;         ///< with that arm, which stands and hangs as the stated one
  double off_m = 0.0;
};
/// Those with as many joints, nearest to the touches first.
std::vector<OtherArm> other_arms(const Cell& cell, const std::vector<Touch>& touches,
                                 const OtherRobots& other_robots);

}  // namespace cellcal::calib
