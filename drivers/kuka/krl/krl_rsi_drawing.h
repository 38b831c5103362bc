#pragma once
// RSI 3's third file: where RSI-Visual draws the objects of the model. Means nothing to the
// controller, but belongs to the unit.

#include <string>

#include "drivers/kuka/krl/krl_files.h"

namespace cellcal::drivers::krl {

/// cellcal_rsi.rsi.diagram, lines ended by '\n'.
std::string rsi3_diagram(const RsiFilesConfig& config);

}  // namespace cellcal::drivers::krl
