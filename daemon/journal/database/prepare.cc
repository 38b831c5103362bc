#include "daemon/journal/database/prepare.h"

#include <fmt/format.h>

#include "daemon/journal/database/earlier_copy.h"
#include "daemon/journal/database/migrations.h"
#include "daemon/journal/database/outbox_rows.h"
#include "daemon/journal/database/schema.h"
#include "daemon/journal/store/error.h"

namespace cellcal::daemon {

namespace {

constexpr int kFirstWithChain = 2;

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
  migrate(database, chain, 0);
  transaction.commit();
  chain.committed();
}

/// One transaction, and a copy of how it was before that.
std::vector<std::string> take_over(Database& database, Chain& chain, int version) {
  std::vector<std::string> remarks;
  const std::vector<std::int64_t> damaged = damaged_sessions(database);
  if (version >= kFirstWithChain) remarks = chain.open();
  const auto copy = keep_earlier(database, version, chain.end());
  Transaction transaction(database);
  const std::int64_t accepted = migrate(database, chain, version);
  if (damaged_sessions(database) != damaged) {
    refuse(database,
           "its rows are not the same in this version. Please report this, with " + copy.string());
  }
  if (!remarks.empty()) begin_source(database);  // a restored copy, as in prepare()
  transaction.commit();
  chain.committed();
  if (!remarks.empty()) chain.write_head();
  if (accepted > 0) {
    remarks.push_back(fmt::format(
        "journal {}: {} rows of an earlier version had no checksums; they are accepted as they "
        "are and have checksums now",
        database.name(), accepted));
  }
  remarks.push_back(
      fmt::format("journal {}: taken over from schema {} to {}; as it was before it is kept as {}",
                  database.name(), version, kSchemaVersion, copy.filename().string()));
  return remarks;
}

void refuse_others(Database& database, std::int64_t version) {
  if (database.integer("PRAGMA application_id") != kApplicationId) {
    refuse(database, "this is the database of another program. Set another state directory");
  }
  if (version > kSchemaVersion) {
    refuse(
        database,
        fmt::format(
            "written by a newer cellcald (schema {}, this version supports up to {}). Install the "
            "newer version again",
            version, kSchemaVersion));
  }
  if (version < 1) {
    refuse(
        database,
        fmt::format(
            "has schema {}, which does not exist: the file is damaged. Move it aside and keep it; "
            "the daemon begins a new one",
            version));
  }
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
  // Refused, it is left as it is: what stands in the log may be all that is left of the newest
  // rows.
  database.keep_log_on_close(true);
  // Nobody else reads or writes it meanwhile; the lock file is what refuses a second daemon.
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
  } else if (version < kSchemaVersion) {
    remarks = take_over(database, chain, static_cast<int>(version));
  } else {
    remarks = chain.open();
    if (!remarks.empty()) {
      begin_source(
          database);  // a restored copy: the journal that it was copied from may go on, too
      chain.write_head();
    }
    for (std::string& words : drop_earlier(database)) remarks.push_back(std::move(words));
  }
  database.keep_log_on_close(false);
  return remarks;
}

}  // namespace cellcal::daemon
