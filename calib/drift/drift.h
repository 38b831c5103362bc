#pragma once
// All checks of one calibration as a control chart.

#include <vector>

#include "calib/result/drift_chart.h"

namespace cellcal::calib {

/// `checks`: in their order, of the same touches where they are not left out. Causes of its course and the advice that needs
/// them are not in it yet: advise().
DriftChart drift_chart(const std::vector<CheckSeen>& checks);

/// Sets the advice by state, course, causes and newest check.
void advise(DriftChart& chart);

/// T_0: the first temperature that is known of checks which count.
std::optional<double> reference_temperature_c(const std::vector<CheckSeen>& checks);

}  // namespace cellcal::calib
