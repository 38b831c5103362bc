#include "daemon/journal/database/migrations.h"

#include <fmt/format.h>

#include <array>

#include "daemon/journal/database/outbox_rows.h"
#include "daemon/journal/database/schema.h"

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

std::int64_t to_8(Database& database, Chain&) {
  database.execute(kSchema8);
  return 0;
}

std::int64_t to_9(Database& database, Chain&) {
  database.execute(kSchema9);
  return 0;
}

constexpr std::array<Migration, kSchemaVersion> kMigrations{to_1, to_2, to_3, to_4,
                                                            to_5, to_6, to_7, to_8, to_9};

}  // namespace

std::int64_t migrate(Database& database, Chain& chain, int from) {
  std::int64_t accepted = 0;
  for (auto step = static_cast<std::size_t>(from); step < kMigrations.size(); ++step)
    accepted += kMigrations[step](database, chain);
  database.execute(fmt::format("PRAGMA user_version = {}", kSchemaVersion).c_str());
  return accepted;
}

}  // namespace cellcal::daemon
