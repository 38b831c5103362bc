#pragma once
// RSI 3's third file: where RSI-Visual draws the objects of the model. Means nothing to the
// controller, but belongs to the unit.

#include <string>

namespace cellcal::drivers::krl {

/// cellcal_rsi.rsi.diagram, lines ended by '\n'. `space`: with POSCORR instead of AXISCORR.
std::string rsi3_diagram(bool space);

}  // namespace cellcal::drivers::krl
