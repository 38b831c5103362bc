#pragma once
// A linear unit in RSI's set: E1 in the packets, and its correction by AXISCORREXT.

#include <string>

#include "drivers/kuka/krl/krl_rsi.h"

namespace cellcal::drivers::krl {

/// Channels of ETHERNET behind the six corrections and STOP.
inline constexpr int kTravelChannel = 8;

/// "AXISCORREXT1" in RSI 3, "AxisCorrExt_1" from RSI 4 on.
const char* travel_corrector(const RsiFilesConfig& config);
/// RECEIVE tag of the correction of E1: "EK.E1".
std::string travel_tag(const RsiFilesConfig& config);

/// Elements of the channel, AXISCORREXT of contexts and model; empty without a linear unit, or without
/// external axes.
void add_travel(const RsiFilesConfig& config, Places& places);

/// Elements of external axes in the channel, and in the context AXISCORREXT with wiring, limits and
/// monitor. `context`: null if unreadable.
void check_travel(const RsiSet& set, const RsiContextFile* context);

}  // namespace cellcal::drivers::krl
