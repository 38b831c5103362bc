#include "daemon/journal/database/migrations.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <map>
#include <string>

#include "calib/files/input_file.h"
#include "daemon/journal/database/outbox_rows.h"
#include "daemon/journal/database/schema.h"
#include "daemon/result/outcome_json.h"

namespace cellcal::daemon {

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
