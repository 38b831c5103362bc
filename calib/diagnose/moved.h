#pragma once
// A target that was knocked or crept during the session. Where it moved by less than what makes
// chi^2 or outliers stand out, the estimate puts it half-way and bends the arm a little, and
// nothing else tells; so each target's touches before and after are compared, in the order in which
// they were made. Spheres, wires and points; planes and trackers have no centre to compare.

#include <vector>

#include "calib/estimate/options.h"
#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Looks closer at the suspects in `calibration.moved`: identifies again with the target taken as
/// two, before and after. Where their distance exceeds its uncertainty, `calibration.moved` holds it
/// and the result is withheld; otherwise `calibration.moved` is emptied. `calibration` is of these
/// touches.
void confirm_moves(const Cell& cell, const std::vector<Touch>& touches,
                   const IdentifyOptions& options, Calibration& calibration);

}  // namespace cellcal::calib
