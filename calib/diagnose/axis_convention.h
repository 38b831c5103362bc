#pragma once
// A robot file whose lengths are right but whose axes are not: some turn the other way, a zero is a
// quarter turn off, a twist has the wrong sign. Joint conventions differ from book to book, and
// such an arm is metres from where it is; which of them it is shows without an estimate (as in
// dimensions.h).

#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "calib/model/touch.h"

namespace cellcal::calib {

/// Where `other` is drawn differently, in the words of robot files: "offset_deg of A2 0 instead of
/// 90". The arms have as many joints.
std::vector<std::string> differences(const Robot& stated, const Robot& other);

struct OtherDrawing {
  Robot robot;
  int changes = 0;
  double off_m = 0.0;  ///< of the nominal arm from the touches, as of nominal_off_m()
};
/// The arm with two axes or more that turn the other way, with one or two zeros a quarter or half a
/// turn off, with one or two twists of the other sign; nearest to the touches first. Without those
/// that come no nearer than one with fewer changes of the same kind.
std::vector<OtherDrawing> other_drawings(const Cell& cell, const std::vector<Touch>& touches);

}  // namespace cellcal::calib
