#include "daemon/journal/prepare.h"

#include <fmt/format.h>

#include "daemon/journal/journal.h"
#include "daemon/journal/schema.h"

namespace cellcal::daemon {

namespace {

[[noreturn]] void refuse(const Database& database, const std::string& words) {
  throw JournalError("journal " + database.name() + ": " + words);
}

void set_version(Database& database) {
  database.execute(fmt::format("PRAGMA user_version = {}", kSchemaVersion).c_str());
}

void make_new(Database& database, HeadFile& head, Chain& chain) {
  if (head.read()) {
    refuse(database,
           "is empty or new, but its .head file lists rows. Restore the journal, or remove the "
           ".head file to begin a new one");
  }
  Transaction transaction(database);
  database.execute(kSchema);
  database.execute(kChainSchema);
  database.execute(fmt::format("PRAGMA application_id = {}", kApplicationId).c_str());
  set_version(database);
  chain.begin();
  transaction.commit();
  chain.committed();
}

/// Version 1 had no checksums.
std::string take_over(Database& database, Chain& chain) {
  Transaction transaction(database);
  database.execute(kChainSchema);
  const std::int64_t rows = chain.take_all();
  set_version(database);
  transaction.commit();
  chain.committed();
  return fmt::format(
      "journal {}: {} rows of an earlier version had no checksums; they are accepted as they "
      "are and have checksums now",
      database.name(), rows);
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
  if (version < kSchemaWithoutChain) {
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
  } else if (version == kSchemaWithoutChain) {
    remarks.push_back(take_over(database, chain));
  } else {
    remarks = chain.open();
    if (!remarks.empty()) chain.write_head();
  }
  database.keep_log_on_close(false);
  return remarks;
}

}  // namespace cellcal::daemon
