#pragma once
// A journal of an earlier version as it was before it was taken over. It stays until it has been
// proven that the new one holds: until a session of the new version is done.

#include <string>
#include <vector>

#include "daemon/journal/database/chain.h"

namespace cellcal::daemon {

/// journal.db.version-2. Whole and on disk when this returns. Throws JournalError.
std::filesystem::path keep_earlier(Database& database, int version, const Head& end);
/// Of copies that are no longer needed: removes them, and says so.
std::vector<std::string> drop_earlier(Database& database);

}  // namespace cellcal::daemon
