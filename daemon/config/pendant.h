#pragma once
// Operator actions at the pendant; the single source of this wording.

#include "daemon/config/config.h"

namespace cellcal::daemon {

/// "start CELLCAL_RSI on the pendant ...", without a full stop.
const char* what_to_start(WireKind wire);

}  // namespace cellcal::daemon
