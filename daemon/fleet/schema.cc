#include <string_view>

#include "daemon/fleet/connection.h"

namespace cellcal::daemon::fleet {

/// schema.sql, compiled in by the build.
extern const std::string_view kSchema;

namespace {

/// Version of the tables and views; others are not opened. Versions up to 5 were never released.
constexpr int kVersion = 6;

}  // namespace

void make_tables(pqxx::connection& connection) {
  guarded([&] {
    pqxx::work work(connection);
    work.exec_params("SELECT pg_advisory_xact_lock($1)", kTablesLock);
    work.exec(
        "CREATE SCHEMA IF NOT EXISTS fleet;"
        "CREATE TABLE IF NOT EXISTS versions (version int PRIMARY KEY, at timestamptz NOT NULL DEFAULT now())");
    const int at = work.exec1("SELECT coalesce(max(version), 0) FROM versions")[0].as<int>();
    if (at != 0 && at != kVersion)
      throw OtherVersion("database: tables of version " + std::to_string(at) + ", supported is " +
                         std::to_string(kVersion) +
                         ". Install the cellcal-fleet that made them, or name an empty database");
    if (at == kVersion) return;
    work.exec(std::string(kSchema));
    work.exec_params0("INSERT INTO versions (version) VALUES ($1)", kVersion);
    work.commit();
  });
}

}  // namespace cellcal::daemon::fleet
