#pragma once
// From a file to a journal of this version: made, taken over from an earlier one, or refused.

#include <string>
#include <vector>

#include "daemon/journal/database/chain.h"

namespace cellcal::daemon {

/// Refuses what is no journal of this version or an earlier one, and what was damaged, by
/// JournalError and without writing to it. Returns what is to be said though it is taken.
std::vector<std::string> prepare(Database& database, HeadFile& head, Chain& chain);

}  // namespace cellcal::daemon
