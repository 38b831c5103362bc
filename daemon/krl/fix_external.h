#pragma once
// External axes in CELLCAL_FIX: numbers of templates/cellcal_fix_external.src.in, the calibration's linear unit and
// positioner.

#include <string>
#include <vector>

#include "calib/result/calibration.h"
#include "daemon/krl/carriers.h"
#include "daemon/krl/fix_lines.h"

namespace cellcal::daemon::krl {

/// Of the linear unit, then of the positioner: "E1" to "E6". Throws FileError for an axis of a positioner with another
/// name.
std::vector<std::string> external_names(const calib::Robot& robot);

/// `anywhere`: a positioner also at angles that nothing was touched at. Throws FileError where the machine data are of
/// another linear unit, or have one kinematic as drawn and another one as found.
void write_external(const calib::Calibration& calibration, const Carriers& carriers, bool anywhere,
                    Lines& out);

}  // namespace cellcal::daemon::krl
