#include "daemon/journal/chain.h"

#include <fmt/format.h>

#include <map>
#include <random>

#include "calib/files/files.h"
#include "calib/syntax/input_file.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon {

namespace {

constexpr const char* kJournal =
    "journal";  ///< kind of the first entry, which tells journals apart

std::string sum_of(const std::string& before, std::int64_t number, std::int64_t session,
                   const std::string& kind, std::int64_t row, const std::string& digest) {
  return calib::sha256(
      fmt::format("{} {} {} {} {} {}", before, number, session, kind, row, digest));
}

/// All rows of one session, or the one row of a table.
std::string rows_of(const std::string& table, const char* column) {
  return "SELECT rowid, * FROM " + table + " WHERE " + column + "=?";
}

const char* session_column(const std::string& table) {
  return table == "session" ? "id" : "session";
}

std::string random_name() {
  std::random_device source;
  std::string name;
  for (int i = 0; i < 8; ++i) name += fmt::format("{:08x}", source());
  return name;
}

}  // namespace

void Chain::fail(const std::string& words) const {
  throw JournalError("journal " + database_.name() + ": " + words);
}

void Chain::append(std::int64_t session, const std::string& table, std::int64_t row,
                   const std::string& digest) {
  const std::int64_t number = newest_.entries + 1;
  std::string sum = sum_of(newest_.sum, number, session, table, row, digest);
  Statement insert(database_,
                   "INSERT INTO chain (number, session, kind, row, digest, sum) "
                   "VALUES (?,?,?,?,?,?)");
  insert.bind(1, number).bind(2, session).bind(3, std::string_view(table)).bind(4, row);
  insert.bind(5, std::string_view(digest)).bind(6, std::string_view(sum)).step();
  newest_ = {number, std::move(sum)};
}

void Chain::begin() { append(0, kJournal, 0, random_name()); }

std::int64_t Chain::take_all() {
  begin();
  const std::int64_t first = newest_.entries;
  for (const std::string table : kChainedTables) {
    Statement rows(database_, ("SELECT " + std::string(session_column(table)) + ", rowid FROM " +
                               table + " ORDER BY rowid")
                                  .c_str());
    while (rows.step()) add(rows.integer(0), table.c_str(), rows.integer(1));
  }
  return newest_.entries - first;
}

void Chain::add(std::int64_t session, const char* table, std::int64_t row) {
  Statement written(database_, rows_of(table, "rowid").c_str());
  if (!written.bind(1, row).step()) fail(fmt::format("row {} of {} is not there", row, table));
  append(session, table, row, calib::sha256(written.bytes()));
}

void Chain::committed() {
  if (newest_.entries != on_disk_.entries) head_.write(newest_);
  on_disk_ = newest_;
}

std::vector<std::string> Chain::open() {
  const std::optional<Head> head = head_.read();
  Statement entries(database_,
                    "SELECT number, session, kind, row, digest, sum FROM chain ORDER BY number");
  newest_ = {};
  bool met = false;
  while (entries.step()) {
    const Head next{newest_.entries + 1,
                    sum_of(newest_.sum, newest_.entries + 1, entries.integer(1), entries.text(2),
                           entries.integer(3), entries.text(4))};
    if (entries.integer(0) != next.entries || entries.text(5) != next.sum) {
      fail(fmt::format(
          "entry {} of its checksums is changed or missing: the disk or another program "
          "damaged the file. Move it aside with its -wal and .head files and keep it; the "
          "daemon begins a new one",
          next.entries));
    }
    newest_ = next;
    met |= head && head->entries == next.entries && head->sum == next.sum;
  }
  on_disk_ = newest_;
  if (!head) {
    return {"journal " + database_.name() +
            ": its .head file was missing, so lost newest rows cannot be detected; a new one "
            "was made"};
  }
  if (newest_.entries < head->entries) {
    fail(fmt::format(
        "{} rows are missing at its end: the write-ahead log was lost or damaged, or an "
        "older copy was restored. Restore the files, or remove the .head file to continue "
        "without these rows",
        head->entries - newest_.entries));
  }
  if (!met) {
    fail(
        "its .head file belongs to another journal. Restore the right one, or remove it to "
        "continue without");
  }
  return {};
}

void Chain::verify(std::int64_t session) {
  std::map<std::pair<std::string, std::int64_t>, std::string> expected;
  Statement entries(database_,
                    "SELECT kind, row, digest FROM chain WHERE session=? ORDER BY number");
  entries.bind(1, session);
  while (entries.step()) expected[{entries.text(0), entries.integer(1)}] = entries.text(2);
  const auto refuse = [&](const std::string& what) {
    fail(fmt::format(
        "session {}: {}: the disk or another program damaged the file. Keep it, do not use "
        "this session, begin a new one",
        session, what));
  };
  for (const std::string table : kChainedTables) {
    Statement rows(database_, rows_of(table, session_column(table)).c_str());
    rows.bind(1, session);
    while (rows.step()) {
      const auto found = expected.find({table, rows.integer(0)});
      if (found == expected.end() || found->second != calib::sha256(rows.bytes())) {
        refuse(
            fmt::format("row {} of '{}' was changed after it was written", rows.integer(0), table));
      }
      expected.erase(found);
    }
  }
  if (!expected.empty()) {
    const auto& [table, row] = expected.begin()->first;
    refuse(fmt::format("row {} of '{}' is missing", row, table));
  }
}

bool Chain::is_whole(std::int64_t session) {
  Statement newest(database_,
                   "SELECT digest FROM chain WHERE session=? AND kind='session' "
                   "ORDER BY number DESC LIMIT 1");
  Statement row(database_, rows_of("session", "id").c_str());
  return newest.bind(1, session).step() && row.bind(1, session).step() &&
         newest.text(0) == calib::sha256(row.bytes());
}

std::int64_t Chain::newest_session() { return database_.integer("SELECT max(session) FROM chain"); }

}  // namespace cellcal::daemon
