#pragma once
// From each version of the tables to the next, one function each.

#include <cstdint>

#include "daemon/journal/database/chain.h"

namespace cellcal::daemon {

/// Brings tables of version `from` (0: none) to kSchemaVersion; how many rows had no checksums and
/// are accepted as they are. Within a transaction: killed or failed, the file is as it was.
std::int64_t migrate(Database& database, Chain& chain, int from);

}  // namespace cellcal::daemon
