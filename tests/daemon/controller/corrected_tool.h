#pragma once
// A tool frame on a controller, before and after correction.

#include "daemon/controller/frame_station.h"

namespace cellcal::daemon::testing {

inline constexpr FrameName kTool3{drivers::EkiFrameKind::kTool, 3};
inline constexpr drivers::EkiFrameValues kOld{59.9, 50.5, 410.3, 38.84, 3.59, 0.0};
inline constexpr drivers::EkiFrameValues kNew{60.1, 50.2, 410.4, 38.84, 3.59, 0.0};

}  // namespace cellcal::daemon::testing
