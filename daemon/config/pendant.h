#pragma once
// What the operator does at the pendant for a session: the one place that has these words.

#include "daemon/config/config.h"

namespace cellcal::daemon {

/// "start CELLCAL_RSI on the pendant ...", without a full stop.
const char* what_to_start(WireKind wire);

}  // namespace cellcal::daemon
