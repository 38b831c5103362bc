#include <array>

#include "daemon/fleet/store/connection.h"
#include "daemon/fleet/store/schema.h"

namespace cellcal::daemon::fleet {

namespace {

std::array<const char*, 5> migrations() { return {kTables, kViews, kKept, kNewest, kOutcomes}; }

void apply(pqxx::work& work, int version) {
  work.exec(migrations().at(static_cast<std::size_t>(version) - 1));
  work.exec_params0("INSERT INTO versions (version) VALUES ($1)", version);
}

}  // namespace

int newest_version() { return static_cast<int>(migrations().size()); }

void migrate(pqxx::connection& connection, int version) {
  guarded([&] {
    pqxx::work work(connection);
    work.exec_params("SELECT pg_advisory_xact_lock($1)", kMigrationLock);
    work.exec(
        "CREATE SCHEMA IF NOT EXISTS fleet;"
        "CREATE TABLE IF NOT EXISTS versions (version int PRIMARY KEY, at timestamptz NOT NULL DEFAULT now())");
    const int at = work.exec1("SELECT coalesce(max(version), 0) FROM versions")[0].as<int>();
    if (at > newest_version())
      throw StoreTooNew("database: tables of version " + std::to_string(at) +
                        ", this program knows " + std::to_string(newest_version()) +
                        ". Update cellcal-fleet");
    for (int next = at + 1; next <= version; ++next) apply(work, next);
    work.commit();
  });
}

void migrate(const std::string& connection, int version) { migrate(*connect(connection), version); }

}  // namespace cellcal::daemon::fleet
