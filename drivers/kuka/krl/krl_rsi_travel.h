#pragma once
// External axes in RSI's set: in the packets, and the correction of a linear unit and of a positioner's axes
// by AXISCORREXT.

#include <cstddef>
#include <string>

#include "drivers/kuka/krl/krl_rsi.h"

namespace cellcal::drivers::krl {

/// Channel of ETHERNET of E1's correction, after the six of the arm and STOP; E2 has the next.
inline constexpr int kTravelChannel = 8;

/// "AXISCORREXT1" in RSI 3, "AxisCorrExt_1" from RSI 4 on.
const char* travel_corrector(const RsiFilesConfig& config);
/// RECEIVE tag of the correction of an external axis: "EK.E1" of the first.
std::string travel_tag(const RsiFilesConfig& config, std::size_t axis);

/// Elements of the channel, AXISCORREXT of contexts and model; empty where no external axis is corrected, or
/// there is none.
void add_travel(const RsiFilesConfig& config, Places& places);

/// Elements of external axes in the channel, and in the context AXISCORREXT with wiring, limits and
/// monitor. `context`: null if unreadable.
void check_travel(const RsiSet& set, const RsiContextFile* context);

}  // namespace cellcal::drivers::krl
