#include "daemon/journal/known_rows.h"

#include <fmt/format.h>

#include <algorithm>

#include "daemon/journal/database/origin.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon {

namespace {

/// To the millisecond: another session of the same number has another one.
std::string started_of(const SessionRows& rows) {
  for (const RowEntry& entry : rows.entries) {
    if (entry.table != "session") continue;
    const auto found = std::find(entry.names.begin(), entry.names.end(), "started");
    if (found == entry.names.end()) continue;
    const Value& value = entry.columns[static_cast<std::size_t>(found - entry.names.begin())];
    if (const auto* text = std::get_if<std::string>(&value)) return *text;
  }
  return "";
}

bool has_entry(Database& database, const RowEntry& entry) {
  Statement find(database, "SELECT 1 FROM chain WHERE number=? AND sum=?");
  return find.bind(1, entry.number).bind(2, std::string_view(entry.sum)).step();
}

/// Who gives the journal another name changes no entry by it.
bool is_own(Database& database, const std::string& name, const SessionRows& rows) {
  if (rows.entries.empty()) return false;
  if (rows.journal != name && !has_entry(database, rows.entries.front())) return false;
  Statement find(database, "SELECT 1 FROM session WHERE id=? AND started=? AND origin IS NULL");
  return find.bind(1, rows.session).bind(2, std::string_view(started_of(rows))).step();
}

void hold_against_own(Database& database, const SessionRows& rows, const std::string& from) {
  Statement own(database, "SELECT number, sum FROM chain WHERE session=? ORDER BY number");
  own.bind(1, rows.session);
  for (const RowEntry& entry : rows.entries) {
    if (!own.step()) return;  // it went on elsewhere
    if (own.integer(0) == entry.number && own.text(1) == entry.sum) continue;
    throw JournalError(fmt::format(
        "{}: session {} was recorded by this journal, and entry {} is not the one that was "
        "recorded: rows were altered, left out or put in. Export the session again",
        from, rows.session, entry.number));
  }
}

void hold_against_imported(Database& database, const SessionRows& rows, const std::string& from) {
  Statement imported(database,
                     "SELECT id, origin FROM session WHERE origin IS NOT NULL AND started=?");
  const std::string started = started_of(rows);
  imported.bind(1, std::string_view(started));
  while (imported.step()) {
    const Origin known = origin_of(imported.text(1));
    if (known.journal != rows.journal || known.session != rows.session) continue;
    // Of an earlier version nothing is known; of an earlier export there is too little to hold against.
    if (known.entries == 0 || known.entries > rows.entries.size()) continue;
    if (sum_of_entries(rows, known.entries) == known.entries_sum) continue;
    throw JournalError(fmt::format(
        "{}: session {} was imported from the same session of the same journal, and its rows are not "
        "the same: one of both was altered. Export the session again, and compare",
        from, imported.integer(0)));
  }
}

}  // namespace

void hold_against_known(Database& database, const std::string& name, const SessionRows& rows,
                        const std::string& from) {
  if (is_own(database, name, rows)) hold_against_own(database, rows, from);
  hold_against_imported(database, rows, from);
}

}  // namespace cellcal::daemon
