#pragma once
// From a file to a journal of this version: made, taken over from an earlier one, or refused.

#include <cstdint>
#include <string>
#include <vector>

#include "daemon/journal/database/chain.h"

namespace cellcal::daemon {

/// Refuses what is no journal of this version or an earlier one, and what was damaged, by
/// JournalError and without writing to it. Returns what is to be said though it is taken.
std::vector<std::string> prepare(Database& database, HeadFile& head, Chain& chain);

// A journal of an earlier version as it was before it was taken over. It stays until it has been
// proven that the new one holds: until a session of the new version is done.

/// journal.db.version-2. Whole and on disk when this returns. Throws JournalError.
std::filesystem::path keep_earlier(Database& database, int version, const Head& end);
/// Of copies that are no longer needed: removes them, and says so.
std::vector<std::string> drop_earlier(Database& database);

// From each version of the tables to the next, one function each.

/// Brings tables of version `from` (0: none) to kSchemaVersion; how many rows had no checksums and
/// are accepted as they are. Within a transaction: killed or failed, the file is as it was.
std::int64_t migrate(Database& database, Chain& chain, int from);

}  // namespace cellcal::daemon
