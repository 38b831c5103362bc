// Deletes raw rows of old sessions; their entries remain in the chain.

#include <fmt/format.h>

#include <algorithm>

#include "daemon/journal/journal.h"

namespace cellcal::daemon {

namespace {

/// Estimated size of a row without texts and blobs: header, numbers, index entry.
constexpr std::int64_t kRowBytes = 60;

/// "length(a) + length(b)" of all columns with texts or blobs.
std::string length_of_texts(Database& database, const std::string& table) {
  Statement columns(database,
                    "SELECT group_concat('coalesce(length(' || name || '), 0)', ' + ') FROM "
                    "pragma_table_info(?) WHERE type IN ('TEXT', 'BLOB')");
  columns.bind(1, std::string_view(table)).step();
  return columns.text(0);
}

/// Approximate size and number of a table's rows of this session.
DroppedRows raw_rows(Database& database, std::int64_t session, const std::string& table) {
  Statement count(database,
                  fmt::format("SELECT count(*), coalesce(sum({}), 0) FROM {} WHERE session=?",
                              length_of_texts(database, table), table)
                      .c_str());
  count.bind(1, session).step();
  return {session, count.integer(0), count.integer(1) + kRowBytes * count.integer(0)};
}

DroppedRows raw_rows(Database& database, std::int64_t session) {
  DroppedRows all{session};
  for (const char* table : kRawTables) {
    const DroppedRows of_table = raw_rows(database, session, table);
    all.rows += of_table.rows;
    all.bytes += of_table.bytes;
  }
  return all;
}

std::int64_t used_bytes(Database& database) {
  const std::int64_t pages =
      database.integer("PRAGMA page_count") - database.integer("PRAGMA freelist_count");
  return pages * database.integer("PRAGMA page_size");
}

}  // namespace

std::int64_t Journal::bytes_in_use() {
  const std::lock_guard lock(mutex_);
  return used_bytes(database_);
}

std::vector<DroppedRows> Journal::retain(const RetentionLimits& limits, const std::string& utc,
                                         bool dry_run, const std::function<bool()>& go_on) {
  std::vector<SessionRecord> all = sessions();
  // The newest may still be resumed, and the next one is compared with it.
  const auto newest =
      std::find_if(all.begin(), all.end(), [](const SessionRecord& one) { return !one.origin; });
  if (newest != all.end()) all.erase(newest);
  std::int64_t used = bytes_in_use();
  std::vector<DroppedRows> gone;
  // A session is not older than the one before it, whatever date the clock had.
  std::string latest;
  for (auto record = all.rbegin(); record != all.rend(); ++record) {
    if (record->state != RecordState::kDamaged)
      latest = std::max(latest, record->ended.empty() ? record->started : record->ended);
    if (record->state == RecordState::kRunning || record->state == RecordState::kDamaged ||
        !record->dropped.empty())
      continue;
    const bool old = !limits.ended_before.empty() && latest < limits.ended_before;
    const bool too_much = limits.bytes && used > *limits.bytes;
    if (!old && !too_much) continue;
    if (go_on && !go_on()) break;
    DroppedRows rows;
    {
      const std::lock_guard lock(mutex_);
      // A damaged session is kept as evidence.
      try {
        chain_.verify(record->id);
      } catch (const JournalError&) {
        continue;
      }
      rows = raw_rows(database_, record->id);
    }
    if (rows.rows == 0) continue;
    if (!dry_run) {
      write([&] {
        for (const char* table : kRawTables) {
          Statement drop(database_, fmt::format("DELETE FROM {} WHERE session=?", table).c_str());
          drop.bind(1, record->id).step();
        }
        chain_.insert(record->id, "dropped", utc, rows.rows);
      });
    }
    used -= rows.bytes;
    gone.push_back(rows);
  }
  return gone;
}

}  // namespace cellcal::daemon
