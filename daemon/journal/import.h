#pragma once
// What a journal knows of a session that somebody wants to import.
//
// Entries are only ever added: of the same session one list of them is the other's beginning, or one of
// both was altered. Held against are the journal's own entries, and of a session that was imported before
// the sum of those that came then.

#include <string>

#include "daemon/journal/rows.h"
#include "daemon/journal/store/sqlite.h"

namespace cellcal::daemon {

/// Throws JournalError naming `from` where they differ. `name` is the journal's.
void hold_against_known(Database& database, const std::string& name, const SessionRows& rows,
                        const std::string& from);

}  // namespace cellcal::daemon
