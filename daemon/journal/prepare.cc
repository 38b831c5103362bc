#include "daemon/journal/prepare.h"

#include <fmt/format.h>

#include "daemon/journal/columns.h"
#include "daemon/journal/outbox_rows.h"
#include "daemon/journal/store/sqlite.h"

namespace cellcal::daemon {

namespace {

constexpr int kEarliestVersion = 11;

/// The other tables.
constexpr const char* kOwnTables = R"sql(
-- Checksums of all rows.
CREATE TABLE chain (
  number  INTEGER PRIMARY KEY,   -- 1, 2, 3, without a gap
  session INTEGER NOT NULL,
  kind    TEXT NOT NULL,         -- the row's table; "journal": the first entry
  row     INTEGER NOT NULL,      -- its rowid
  digest  TEXT NOT NULL,         -- SHA-256 of the row
  sum     TEXT NOT NULL          -- SHA-256 of the entry before and of this one
) STRICT;
CREATE INDEX chain_of_session ON chain (session, kind);
-- Reports that are not acknowledged yet. Not part of the chain: the rows that they report are.
CREATE TABLE outbox (
  number  INTEGER PRIMARY KEY AUTOINCREMENT,  -- never used twice
  session INTEGER NOT NULL,                   -- 0: of none
  time    TEXT NOT NULL,
  kind    TEXT NOT NULL,
  worth   TEXT NOT NULL,                      -- result, telemetry
  body    TEXT NOT NULL                       -- JSON; '': composed of the session's calibration
) STRICT;
CREATE INDEX outbox_telemetry ON outbox (number) WHERE worth='telemetry';
CREATE TABLE outbox_source (
  first       INTEGER PRIMARY KEY,            -- number in outbox that is the first under this name
  name        TEXT NOT NULL,
  interrupted INTEGER NOT NULL DEFAULT 0,     -- entry of the chain whose interruption was reported
  address     TEXT NOT NULL DEFAULT ''        -- under which its numbers are reported; '': not known
) STRICT;
-- State of the schedule; one row, which is replaced. Belongs to no session, hence its own sum.
CREATE TABLE schedule (
  id    INTEGER PRIMARY KEY CHECK (id = 1),
  state TEXT NOT NULL,                        -- JSON, cellcal.schedule/1
  sum   TEXT NOT NULL                         -- SHA-256 of state
) STRICT;
)sql";

const char* type_of(Holds holds) {
  switch (holds) {
    case Holds::kText:
    case Holds::kName: return "TEXT";
    case Holds::kFlag:
    case Holds::kCount:
    case Holds::kWhole: return "INTEGER";
    case Holds::kNumber:
    case Holds::kFinite:
    case Holds::kNotNegative: return "REAL";
    default: return "BLOB";
  }
}

std::string column_sql(const Column& column) {
  const std::string type = type_of(column.holds);
  std::string sql = fmt::format(", {} {}", column.name, type);
  if (column.absent != Absent::kNull) sql += " NOT NULL";
  if (column.absent == Absent::kEmpty) sql += type == "TEXT" ? " DEFAULT ''" : " DEFAULT 0";
  return sql;
}

/// All tables, sessions first.
std::string schema() {
  std::string sql;
  for (const std::string table : kChainedTables) {
    const bool sessions = table == "session";
    std::string columns = sessions ? "id INTEGER PRIMARY KEY AUTOINCREMENT"
                                   : "session INTEGER NOT NULL REFERENCES session(id)";
    for (const Column& one : kColumns)
      if (one.table == table && one.name != std::string_view("id")) columns += column_sql(one);
    if (table == "touch") columns += ", UNIQUE (session, number)";
    sql += fmt::format("CREATE TABLE {} ({}) STRICT;\n", table, columns);
    if (!sessions && table != "touch")
      sql += fmt::format("CREATE INDEX {0}_of_session ON {0} (session);\n", table);
  }
  return sql + kOwnTables;
}

template <class Error = JournalError>
[[noreturn]] void refuse(const Database& database, const std::string& words) {
  throw Error("journal " + database.name() + ": " + words);
}

void make_new(Database& database, HeadFile& head, Chain& chain) {
  if (head.read()) {
    refuse(database,
           "is empty or new, but its .head file lists rows. Restore the journal, or remove the "
           ".head file to begin a new one");
  }
  Transaction transaction(database);
  database.execute(schema().c_str());
  database.execute(fmt::format("PRAGMA application_id = {}; PRAGMA user_version = {}",
                               kApplicationId, kSchemaVersion)
                       .c_str());
  chain.begin();
  begin_source(database);
  transaction.commit();
  chain.committed();
}

void refuse_others(Database& database, std::int64_t version) {
  if (database.integer("PRAGMA application_id") != kApplicationId) {
    refuse<OtherJournalError>(
        database, "this is the database of another program. Set another state directory");
  }
  if (version < kEarliestVersion || version > kSchemaVersion) {
    refuse<OtherJournalError>(
        database,
        fmt::format(
            "schema version {}, supported is {}. Install the cellcald that wrote it, or move it aside "
            "with its -wal and .head files; the daemon begins a new one",
            version, kSchemaVersion));
  }
}

/// Its rows have the same checksums with the new columns, which are NULL in all of them.
void convert(Database& database, std::int64_t version) {
  Transaction transaction(database);
  if (version < 12) database.execute("ALTER TABLE touch ADD COLUMN load TEXT");
  database.execute(
      fmt::format("ALTER TABLE touch ADD COLUMN positioner_rad BLOB; PRAGMA user_version = {}",
                  kSchemaVersion)
          .c_str());
  transaction.commit();
}

void refuse_damaged(Database& database) {
  const std::string check = database.text("PRAGMA quick_check(1)");
  if (check == "ok") return;
  refuse(database, "damaged (" + check +
                       "). Move it aside with its -wal and .head files and keep it; the daemon "
                       "begins a new one");
}

}  // namespace

std::vector<std::string> prepare(Database& database, HeadFile& head, Chain& chain) {
  // A refused journal is not changed: its log may hold the only copy of the newest
  // rows.
  database.keep_log_on_close(true);
  // Exclusive access; a second daemon is refused by the lock file.
  database.execute("PRAGMA busy_timeout = 1000; PRAGMA locking_mode = EXCLUSIVE");
  const std::int64_t tables = database.integer("SELECT count(*) FROM sqlite_schema");
  const std::int64_t version = database.integer("PRAGMA user_version");
  if (tables > 0) {
    refuse_others(database, version);
    refuse_damaged(database);
  }
  const std::string mode = database.text("PRAGMA journal_mode = WAL");
  if (mode != "wal") {
    refuse(database, "no write-ahead log on this file system (" + mode +
                         "). Put the state directory on a local disk");
  }
  database.execute("PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON");
  std::vector<std::string> remarks;
  if (tables == 0) {
    make_new(database, head, chain);
  } else {
    remarks = chain.open();
    if (version < kSchemaVersion) convert(database, version);
    if (!remarks.empty()) {
      // A restored copy: the journal that it was copied from may have continued.
      begin_source(database);
      database.run("UPDATE schedule SET sum = ? || substr(sum, -64)", kOlderSchedule);
      chain.write_head();
    }
  }
  database.keep_log_on_close(false);
  return remarks;
}

}  // namespace cellcal::daemon
