#pragma once
// A robot file whose lengths are right but whose axes are not: some turn the other way, a zero is a
// quarter turn off, a twist has the wrong sign. Joint conventions differ from book to book, and
// such an arm is metres from where it is; which of them it is shows without an estimate (as in
// dimensions.h).

#include <vector>

#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/result/finding.h"

namespace cellcal::calib {

/// Where `other` is drawn differently: joints, each with a field of robot files as it is there, and
/// as it is "stated". The arms have as many joints.
std::vector<FindingPart> differences(const Robot& stated, const Robot& other);

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
