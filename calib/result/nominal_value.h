#pragma once
// What robot and cell file state of a parameter that is identified as a deviation.

#include "calib/model/parameter_key.h"
#include "calib/model/robot.h"

namespace cellcal::calib {

/// [SI]. Of a joint's theta (its zero), d, a, alpha, beta and of the tool's x, y, z; 0 of all
/// others, which have no nominal value.
double stated_value(const Cell& cell, const ParameterKey& parameter);

}  // namespace cellcal::calib
