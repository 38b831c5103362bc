#pragma once
// Comparison of a session to be imported with the journal's own entries.
//
// Entries are append-only: of two exports of one session, one is a prefix of the other, or one of them was
// altered. The comparison covers the journal's own entries and, for a session imported earlier, their sum at
// that time.

#include <string>

#include "daemon/journal/rows.h"
#include "daemon/journal/store/sqlite.h"

namespace cellcal::daemon {

/// Throws JournalError naming `from` if they differ. `name`: name of the journal.
void compare_with_imported(Database& database, const std::string& name, const SessionRows& rows,
                           const std::string& from);

}  // namespace cellcal::daemon
