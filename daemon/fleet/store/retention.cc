#include <array>
#include <tuple>

#include "daemon/fleet/store/connection.h"

namespace cellcal::daemon::fleet {

namespace {

constexpr int kMonthsAhead = 2;
/// Telemetry alone is in partitions, and so nothing else is ever dropped.
constexpr std::array kTelemetry{"phases", "touches", "health"};
/// Making waits for no reader and no writer, but for another collector that makes the same.
constexpr const char* kMakingWaits = "SET LOCAL lock_timeout = '2s'";
/// Dropping asks for the table alone, and who comes behind it waits as long as it does.
constexpr const char* kDroppingWaits = "SET LOCAL lock_timeout = '200ms'";

/// "CREATE TABLE ... PARTITION OF" would wait for all who read or write the table, and all who come later for it.
void make_month(pqxx::work& work, const std::string& table, int ahead) {
  const auto [name, from, to, is_there] = [&] {
    const pqxx::row month = work.exec_params1(
        "SELECT n.name, m::date, (m + interval '1 month')::date, to_regclass(n.name) IS NOT NULL FROM "
        "(SELECT date_trunc('month', now()) + make_interval(months => $1) AS m) AS months, "
        "LATERAL (SELECT $2 || to_char(m, '_YYYY_MM') AS name) AS n",
        ahead, table);
    return std::tuple(month[0].as<std::string>(), month[1].as<std::string>(),
                      month[2].as<std::string>(), month[3].as<bool>());
  }();
  if (is_there) return;
  work.exec("CREATE TABLE " + work.quote_name(name) + " (LIKE " + work.quote_name(table) +
            " INCLUDING ALL); ALTER TABLE " + work.quote_name(table) + " ATTACH PARTITION " +
            work.quote_name(name) + " FOR VALUES FROM (" + work.quote(from) + ") TO (" +
            work.quote(to) + ")");
}

void drop_old(pqxx::work& work, const std::string& table, int months) {
  const pqxx::result all = work.exec_params(
      "SELECT c.relname, to_date(right(c.relname, 7), 'YYYY_MM') < date_trunc('month', now()) - "
      "make_interval(months => $2) FROM pg_inherits i JOIN pg_class c ON c.oid = i.inhrelid "
      "WHERE i.inhparent = to_regclass($1) AND c.relname ~ '_[0-9]{4}_[0-9]{2}$' "
      "ORDER BY to_date(right(c.relname, 7), 'YYYY_MM') DESC",
      table, months);
  int newer = 0;  // months that hold something
  for (const auto& row : all) {
    const std::string name = work.quote_name(row[0].as<std::string>());
    const bool holds = work.exec1("SELECT EXISTS (SELECT FROM " + name + ")")[0].as<bool>();
    if (row[1].as<bool>() && (!holds || newer >= months)) work.exec("DROP TABLE " + name);
    newer += holds ? 1 : 0;
  }
}

/// One transaction for each table: what one has is not held while another is waited for.
template <class Work>
std::vector<std::string> for_each_table(pqxx::connection& connection, const char* waits,
                                        const char* what, Work act) {
  std::vector<std::string> put_off;
  for (const char* table : kTelemetry) {
    try {
      guarded([&] {
        pqxx::work work(connection);
        work.exec(waits);
        work.exec_params("SELECT pg_advisory_xact_lock($1)", kMigrationLock);
        act(work, table);
        work.commit();
      });
    } catch (const Locked&) {
      put_off.push_back(std::string("fleet.") + table + ": " + what);
    }
  }
  return put_off;
}

}  // namespace

std::vector<std::string> make_months(pqxx::connection& connection) {
  return for_each_table(connection, kMakingWaits, "the next months' tables",
                        [](pqxx::work& work, const char* table) {
                          for (int ahead = 0; ahead <= kMonthsAhead; ++ahead)
                            make_month(work, table, ahead);
                        });
}

std::vector<std::string> drop_months(pqxx::connection& connection, int telemetry_months) {
  return for_each_table(
      connection, kDroppingWaits, "dropping old months",
      [&](pqxx::work& work, const char* table) { drop_old(work, table, telemetry_months); });
}

}  // namespace cellcal::daemon::fleet
