#include "daemon/journal/database/prepare.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <map>
#include <string>

#include "calib/files/input_file.h"
#include "daemon/journal/database/database_copy.h"
#include "daemon/journal/database/outbox_rows.h"
#include "daemon/journal/database/schema.h"
#include "daemon/journal/store/error.h"
#include "daemon/result/outcome_json.h"

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

namespace {

constexpr int kAllPages = -1;

std::filesystem::path copy_of(const Database& database, int version) {
  return fmt::format("{}.version-{}", database.name(), version);
}

}  // namespace

std::filesystem::path keep_earlier(Database& database, int version, const Head& end) {
  std::filesystem::path path = copy_of(database, version);
  // Of a take-over that was killed; the journal itself is still what counts.
  std::filesystem::remove(path);
  DatabaseCopy copy(database, path);
  while (copy.step(kAllPages)) continue;
  copy.look_through(end);
  copy.publish();
  return path;
}

std::vector<std::string> drop_earlier(Database& database) {
  std::vector<std::string> words;
  if (database.integer("SELECT count(*) FROM session WHERE state='done' AND software IS NOT NULL "
                       "AND origin IS NULL") == 0)
    return words;
  for (int version = 1; version < kSchemaVersion; ++version) {
    const std::filesystem::path path = copy_of(database, version);
    std::error_code code;
    if (std::filesystem::remove(path, code))
      words.push_back("journal " + database.name() + ": sessions of this version are done; " +
                      path.filename().string() + ", kept of the version before, was removed");
  }
  return words;
}

namespace {

/// How many rows it gave checksums to.
using Migration = std::int64_t (*)(Database&, Chain&);

std::int64_t to_1(Database& database, Chain&) {
  database.execute(kSchema1);
  database.execute(fmt::format("PRAGMA application_id = {}", kApplicationId).c_str());
  return 0;
}

std::int64_t to_2(Database& database, Chain& chain) {
  database.execute(kSchema2);
  return chain.take_all();
}

std::int64_t to_3(Database& database, Chain&) {
  database.execute(kSchema3);
  return 0;
}

std::int64_t to_4(Database& database, Chain&) {
  database.execute(kSchema4);
  return 0;
}

std::int64_t to_5(Database& database, Chain&) {
  database.execute(kSchema5);
  return 0;
}

std::int64_t to_6(Database& database, Chain&) {
  database.execute(kSchema6);
  begin_source(database);
  return 0;
}

std::int64_t to_7(Database& database, Chain&) {
  database.execute(kSchema7);
  return 0;
}

/// Before version 8 only a file beside the journal (daemon/service, results_dir) said whether a check held. It is read once, and
/// what it says has a checksum from then on. A session that is damaged stays so.
void take_outcomes_of_checks(Database& database, Chain& chain) {
  const auto results = std::filesystem::path(database.name()).parent_path() / "sessions";
  std::map<std::int64_t, std::string> outcomes;
  Statement done(database, "SELECT id FROM session WHERE state='done'");
  while (done.step()) try {
      const auto file = results / std::to_string(done.integer(0)) / "check.json";
      if (!std::filesystem::exists(file)) continue;
      verify_rows(database, done.integer(0));
      if (const auto outcome = outcome_of_check(calib::read_file(file)))
        outcomes[done.integer(0)] = outcome_to_json(*outcome);
    } catch (const std::exception&) {  // it stays without one, as where the file is gone
    }
  for (const auto& [session, outcome] : outcomes) {
    Statement update(database, "UPDATE session SET outcome=? WHERE id=?");
    update.bind(1, std::string_view(outcome)).bind(2, session).step();
    chain.add(session, "session", session);
  }
}

std::int64_t to_8(Database& database, Chain& chain) {
  database.execute(kSchema8);
  take_outcomes_of_checks(database, chain);
  return 0;
}

std::int64_t to_9(Database& database, Chain&) {
  database.execute(kSchema9);
  return 0;
}

std::int64_t to_10(Database& database, Chain&) {
  database.execute(kSchema10);
  return 0;
}

constexpr std::array<Migration, kSchemaVersion> kMigrations{to_1, to_2, to_3, to_4, to_5,
                                                            to_6, to_7, to_8, to_9, to_10};

}  // namespace

std::int64_t migrate(Database& database, Chain& chain, int from) {
  std::int64_t accepted = 0;
  for (auto step = static_cast<std::size_t>(from); step < kMigrations.size(); ++step)
    accepted += kMigrations[step](database, chain);
  database.execute(fmt::format("PRAGMA user_version = {}", kSchemaVersion).c_str());
  return accepted;
}

}  // namespace cellcal::daemon
