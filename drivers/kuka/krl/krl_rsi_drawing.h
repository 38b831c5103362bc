#pragma once
// RSI 3's third file: the layout of the model in RSI-Visual. Ignored by the controller, but part of
// the unit.

#include <string>

#include "drivers/kuka/krl/krl_files.h"

namespace cellcal::drivers::krl {

/// cellcal_rsi.rsi.diagram, lines terminated by '\n'.
std::string rsi3_diagram(const RsiFilesConfig& config);

}  // namespace cellcal::drivers::krl
