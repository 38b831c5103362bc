#include "daemon/journal/chain.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <random>

#include "calib/files/files.h"
#include "calib/files/input_file.h"

namespace cellcal::daemon {

std::string random_name(int words) {
  std::random_device source;
  std::string name;
  for (int i = 0; i < words; ++i) name += fmt::format("{:08x}", source());
  return name;
}

namespace {

constexpr const char* kJournal =
    "journal";  ///< kind of the first entry; its digest is the journal's name

[[noreturn]] void fail(const Database& database, const std::string& words) {
  throw JournalError("journal " + database.name() + ": " + words);
}

/// Number of the session's newest 'dropped' entry; 0 if there is none.
std::int64_t dropped_before(Database& database, std::int64_t session) {
  Statement newest(database, "SELECT max(number) FROM chain WHERE session=? AND kind='dropped'");
  return newest.bind(1, session).step() ? newest.integer(0) : 0;
}

}  // namespace

std::string sum_of(const std::string& before, std::int64_t number, std::int64_t session,
                   const std::string& kind, std::int64_t row, const std::string& digest) {
  return calib::sha256(
      fmt::format("{} {} {} {} {} {}", before, number, session, kind, row, digest));
}

std::string digest_of(const std::vector<Value>& row) {
  std::size_t filled = row.size();
  while (filled > 0 && std::holds_alternative<std::monostate>(row[filled - 1])) --filled;
  return calib::sha256(bytes_of(std::span(row).first(filled)));
}

std::string rows_of(const std::string& table, const char* column) {
  return "SELECT rowid, * FROM " + table + " WHERE " + column + "=?";
}

const char* session_column(const std::string& table) {
  return table == "session" ? "id" : "session";
}

void Chain::append(std::int64_t session, const std::string& table, std::int64_t row,
                   const std::string& digest) {
  known_.erase(session);
  const std::int64_t number = newest_.entries + 1;
  std::string sum = sum_of(newest_.sum, number, session, table, row, digest);
  database_.run("INSERT INTO chain (number, session, kind, row, digest, sum) VALUES (?,?,?,?,?,?)",
                number, session, table, row, digest, sum);
  newest_ = {number, std::move(sum)};
}

void Chain::begin() { append(0, kJournal, 0, random_name(8)); }

void Chain::add(std::int64_t session, const char* table, std::int64_t row) {
  Statement written(database_, rows_of(table, "rowid").c_str());
  if (!written.bind(1, row).step())
    fail(database_, fmt::format("row {} of {} is missing", row, table));
  append(session, table, row, digest_of(written.values()));
}

void Chain::committed() {
  head_due_ |= newest_.entries != on_disk_.entries;
  on_disk_ = newest_;  // also where the head cannot be written: a rollback goes back to here
  if (head_due_) head_.write(newest_);
  head_due_ = false;
}

Walked walk_chain(Database& database, const std::optional<Head>& expected) {
  Statement entries(database,
                    "SELECT number, session, kind, row, digest, sum FROM chain ORDER BY number");
  Walked walked;
  while (entries.step()) {
    const std::int64_t number = walked.end.entries + 1;
    const Head next{number, sum_of(walked.end.sum, number, entries.integer(1), entries.text(2),
                                   entries.integer(3), entries.text(4))};
    if (entries.integer(0) != next.entries || entries.text(5) != next.sum) {
      fail(database,
           fmt::format(
               "entry {} of its checksums is changed or missing: the disk or another program "
               "damaged the file. Move it aside with its -wal and .head files and keep it; the "
               "daemon begins a new one",
               next.entries));
    }
    walked.end = next;
    walked.met |= expected && expected->entries == next.entries && expected->sum == next.sum;
  }
  return walked;
}

std::vector<std::string> Chain::open() {
  const std::optional<Head> head = head_.read();
  const Walked walked = walk_chain(database_, head);
  newest_ = on_disk_ = walked.end;
  if (!head) {
    return {"journal " + database_.name() +
            ": its .head file was missing, so lost newest rows cannot be detected; a new one "
            "was made"};
  }
  if (newest_.entries < head->entries) {
    fail(database_,
         fmt::format(
             "{} rows are missing at its end: the write-ahead log was lost or damaged, or an "
             "older copy was restored. Restore the files, or remove the .head file to continue "
             "without these rows",
             head->entries - newest_.entries));
  }
  if (!walked.met) {
    fail(database_,
         "its .head file belongs to another journal. Restore the right one, or remove it to "
         "continue without");
  }
  return {};
}

bool is_raw(const std::string& table) {
  return std::find(std::begin(kRawTables), std::end(kRawTables), table) != std::end(kRawTables);
}

void verify_rows(Database& database, std::int64_t session) {
  std::map<std::pair<std::string, std::int64_t>, std::string> expected;
  const std::int64_t dropped = dropped_before(database, session);
  Statement entries(database,
                    "SELECT kind, row, digest, number FROM chain WHERE session=? ORDER BY number",
                    session);
  while (entries.step()) {
    // A dropped row that is present again is unexpected.
    if (entries.integer(3) < dropped && is_raw(entries.text(0))) continue;
    expected[{entries.text(0), entries.integer(1)}] = entries.text(2);
  }
  const auto refuse = [&](const std::string& what) {
    throw DamagedError(fmt::format(
        "journal {}: session {}: {}: the disk or another program damaged the file. Keep it, do not use "
        "this session, begin a new one",
        database.name(), session, what));
  };
  for (const std::string table : kChainedTables) {
    Statement rows(database, rows_of(table, session_column(table)).c_str(), session);
    while (rows.step()) {
      const auto found = expected.find({table, rows.integer(0)});
      if (found == expected.end() || found->second != digest_of(rows.values())) {
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

std::vector<std::int64_t> damaged_sessions(Database& database) {
  std::vector<std::int64_t> damaged;
  Statement sessions(database, "SELECT DISTINCT session FROM chain WHERE session>0");
  while (sessions.step()) {
    try {
      verify_rows(database, sessions.integer(0));
    } catch (const JournalError&) {  // counted as damaged
      damaged.push_back(sessions.integer(0));
    }
  }
  return damaged;
}

void Chain::verify(std::int64_t session) {
  known_[session].all_rows.reset();
  try {
    verify_rows(database_, session);
    known_[session].all_rows = true;
  } catch (const DamagedError&) {
    known_[session].all_rows = false;
    throw;
  }
}

bool Chain::was_verified(std::int64_t session) const {
  const auto found = known_.find(session);
  return found != known_.end() && found->second.all_rows.has_value();
}

bool Chain::is_whole(std::int64_t session) {
  Known& known = known_[session];
  if (!known.own_row) {
    Statement newest(database_,
                     "SELECT digest FROM chain WHERE session=? AND kind='session' "
                     "ORDER BY number DESC LIMIT 1");
    Statement row(database_, rows_of("session", "id").c_str());
    known.own_row = newest.bind(1, session).step() && row.bind(1, session).step() &&
                    newest.text(0) == digest_of(row.values());
  }
  return *known.own_row && known.all_rows.value_or(true);
}

bool Chain::is_whole(std::int64_t session, const char* table, std::int64_t row) {
  Statement newest(
      database_,
      "SELECT digest FROM chain WHERE session=? AND kind=? AND row=? ORDER BY number DESC LIMIT 1");
  newest.bind(1, session).bind(2, std::string_view(table)).bind(3, row);
  Statement written(database_, rows_of(table, "rowid").c_str());
  return newest.step() && written.bind(1, row).step() &&
         newest.text(0) == digest_of(written.values());
}

std::int64_t Chain::last_entry(std::int64_t session) {
  Statement newest(database_, "SELECT max(number) FROM chain WHERE session=? AND kind='session'");
  return newest.bind(1, session).step() ? newest.integer(0) : 0;
}

std::string Chain::name() { return database_.text("SELECT digest FROM chain WHERE number=1"); }

std::int64_t Chain::newest_session() { return database_.integer("SELECT max(session) FROM chain"); }

using nlohmann::json;

std::string to_text(const Origin& origin) {
  return json{{"journal", origin.journal},
              {"session", origin.session},
              {"sum", origin.sum},
              {"entries", origin.entries},
              {"entries_sum", origin.entries_sum}}
      .dump();
}

Origin origin_of(const std::string& text) try {
  const json stored = json::parse(text);
  return {stored.value("journal", ""), stored.value("session", std::int64_t{0}),
          stored.value("sum", ""), stored.value("entries", std::size_t{0}),
          stored.value("entries_sum", "")};
} catch (const json::exception&) {  // malformed
  return {};
}

}  // namespace cellcal::daemon
