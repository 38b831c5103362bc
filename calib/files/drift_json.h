#pragma once
// A control chart as a document: "cellcal.drift/1", millimetres, with its words.

#include <string>

#include "calib/result/drift_chart.h"

namespace cellcal::calib {

std::string drift_to_json(const DriftChart& chart);

}  // namespace cellcal::calib
