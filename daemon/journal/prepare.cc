#include "daemon/journal/prepare.h"

#include <fmt/format.h>

#include "daemon/journal/outbox_rows.h"
#include "daemon/journal/store/sqlite.h"

namespace cellcal::daemon {

namespace {

constexpr int kEarliestVersion = 11;

[[noreturn]] void refuse(const Database& database, const std::string& words) {
  throw JournalError("journal " + database.name() + ": " + words);
}

void make_new(Database& database, HeadFile& head, Chain& chain) {
  if (head.read()) {
    refuse(database,
           "is empty or new, but its .head file lists rows. Restore the journal, or remove the "
           ".head file to begin a new one");
  }
  Transaction transaction(database);
  database.execute(kSchema);
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
    refuse(database, "this is the database of another program. Set another state directory");
  }
  if (version < kEarliestVersion || version > kSchemaVersion) {
    refuse(
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
