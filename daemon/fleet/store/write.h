#pragma once
// Within this room: one batch in one transaction.

#include <vector>

#include "daemon/fleet/store/connection.h"

namespace cellcal::daemon::fleet {

/// Throws StoreAway, BadData; then nothing of it is written.
Written write_once(pqxx::connection& connection, const Batch& batch);

}  // namespace cellcal::daemon::fleet
