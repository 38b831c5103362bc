#include <cstdio>

#include "daemon/fleet/store/connection.h"

namespace cellcal::daemon::fleet {

namespace {

constexpr int kMonthsAhead = 2;

/// Telemetry alone is in partitions, and so nothing else is ever dropped.
void make_ahead(pqxx::work& work, const std::string& table) {
  for (int ahead = 0; ahead <= kMonthsAhead; ++ahead) {
    const auto [name, from, to] = [&] {
      const pqxx::row month = work.exec_params1(
          "SELECT to_char(m, 'YYYY_MM'), m::date, (m + interval '1 month')::date FROM "
          "(SELECT date_trunc('month', now()) + make_interval(months => $1) AS m) AS months",
          ahead);
      return std::tuple(month[0].as<std::string>(), month[1].as<std::string>(),
                        month[2].as<std::string>());
    }();
    work.exec("CREATE TABLE IF NOT EXISTS " + work.quote_name(table + "_" + name) +
              " PARTITION OF " + work.quote_name(table) + " FOR VALUES FROM (" + work.quote(from) +
              ") TO (" + work.quote(to) + ")");
  }
}

void drop_old(pqxx::work& work, const std::string& table, int months) {
  const pqxx::result old = work.exec_params(
      "SELECT c.relname FROM pg_inherits i JOIN pg_class c ON c.oid = i.inhrelid "
      "WHERE i.inhparent = to_regclass($1) AND c.relname ~ '_[0-9]{4}_[0-9]{2}$' AND "
      "to_date(right(c.relname, 7), 'YYYY_MM') < date_trunc('month', now()) - make_interval(months => $2)",
      table, months);
  for (const auto& row : old) work.exec("DROP TABLE " + work.quote_name(row[0].as<std::string>()));
}

}  // namespace

void maintain_partitions(pqxx::connection& connection, int telemetry_months) {
  guarded([&] {
    pqxx::work work(connection);
    work.exec_params("SELECT pg_advisory_xact_lock($1)", kMigrationLock);
    for (const char* table : {"phases", "touches", "health"}) {
      make_ahead(work, table);
      drop_old(work, table, telemetry_months);
    }
    work.commit();
  });
}

}  // namespace cellcal::daemon::fleet
