#pragma once
// Opening a database file as a journal: created, accepted or refused.

#include <string>
#include <vector>

#include "daemon/journal/chain.h"

namespace cellcal::daemon {

/// Throws JournalError for a file of another program or schema version, or a damaged one, without
/// writing to it. Returns warnings.
std::vector<std::string> prepare(Database& database, HeadFile& head, Chain& chain);

}  // namespace cellcal::daemon
