#pragma once
// Opening a database file as a journal: created, accepted or refused.

#include <string>
#include <vector>

#include "daemon/journal/chain.h"

namespace cellcal::daemon {

/// Throws JournalError for a file of another program or schema version, or a damaged one, without
/// writing to it. Returns warnings.
std::vector<std::string> prepare(Database& database, HeadFile& head, Chain& chain);

/// PRAGMA user_version. Versions 11 and 12 lack the last two, or the last, of touch's columns and are
/// converted; no other version is opened, and those up to 10 were never released.
inline constexpr int kSchemaVersion = 13;
/// PRAGMA application_id, "ccal": distinguishes a journal from other SQLite files.
inline constexpr int kApplicationId = 0x6363616c;

/// Precedes the sum of the schedule's state where a later one may exist.
inline constexpr const char* kOlderSchedule = "older ";

}  // namespace cellcal::daemon
