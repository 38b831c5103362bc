#include "daemon/fleet/store.h"

#include <array>
#include <tuple>

#include "daemon/fleet/connection.h"

namespace cellcal::daemon::fleet {

struct Store::Impl {
  StoreConfig config;
  std::unique_ptr<pqxx::connection> connection;
};

namespace {

constexpr double kSettledAfterMin = 5.0;

/// Gaps below a number that was the newest some minutes ago count as final rather than as disorder.
/// Journals that are being written are skipped until the next time: locking rows in different
/// orders would cause a deadlock.
void settle(pqxx::connection& connection) {
  guarded([&] {
    pqxx::work work(connection);
    work.exec_params(
        "UPDATE journals SET settled = mark, mark = upper(numbers) - 1, marked = now() WHERE id IN (SELECT id FROM "
        "journals WHERE numbers <> '{}' AND marked NOT BETWEEN now() - make_interval(mins => $1) AND now() AND "
        "(settled, mark) <> (mark, upper(numbers) - 1) ORDER BY id FOR UPDATE SKIP LOCKED)",
        static_cast<int>(kSettledAfterMin));
    work.commit();
  });
}

void state_settings(pqxx::connection& connection, const StoreConfig& config) {
  guarded([&] {
    pqxx::work work(connection);
    work.exec_params0(
        "UPDATE settings SET calibration_days = $1, check_days = $2 WHERE (calibration_days, check_days) "
        "IS DISTINCT FROM ($1, $2)",
        config.calibration_days, config.check_days);
    work.commit();
  });
}

/// Batch of a single message.
template <class T>
Batch only(std::vector<T> Batch::*member, const T& one) {
  Batch batch;
  (batch.*member).push_back(one);
  return batch;
}

/// Writes the batch, after creating the partition of the month if it is missing: in a new database,
/// or after a change of its clock.
Written write_in_its_month(pqxx::connection& connection, const Batch& batch) {
  try {
    return write_once(connection, batch);
  } catch (const NoMonth&) {
    make_months(connection);
  }
  try {
    return write_once(connection, batch);
  } catch (const NoMonth& held_by_others) {
    throw StoreUnavailable(held_by_others.what());
  }
}

Written write_or_quarantine(pqxx::connection& connection, const Batch& one,
                            const Refused& otherwise) {
  try {
    return write_in_its_month(connection, one);
  } catch (const BadData& bad) {
    Refused refused = otherwise;
    refused.words = bad.what();
    return write_once(connection, only(&Batch::refused, refused));
  }
}

/// Writes everything except the messages that PostgreSQL rejects, which are quarantined.
Written write_one_by_one(pqxx::connection& connection, const Batch& batch) {
  Written written;
  for (const plant::Fact& fact : batch.facts)
    written += write_or_quarantine(connection, only(&Batch::facts, fact),
                                   refused_as(fact, Refusal::kDatabase, ""));
  for (const plant::Presence& presence : batch.presences)
    written += write_or_quarantine(connection, only(&Batch::presences, presence),
                                   refused_as(presence, Refusal::kDatabase, ""));
  Batch rest;
  rest.refused = batch.refused;
  rest.too_many = batch.too_many;
  written += write_once(connection, rest);
  return written;
}

/// Number of messages per call; certificates are large.
constexpr int kAtOnce = 8;

constexpr int kMonthsAhead = 2;
/// Partitioned tables: only telemetry, so that nothing else is ever dropped.
constexpr std::array kTelemetry{"phases", "touches", "health"};
/// Creation waits for no reader or writer, only for another collector that creates the same.
constexpr const char* kMakingWaits = "SET LOCAL lock_timeout = '2s'";
/// Dropping needs an exclusive lock, and later requests wait for as long as it does.
constexpr const char* kDroppingWaits = "SET LOCAL lock_timeout = '200ms'";

/// Avoids "CREATE TABLE ... PARTITION OF", which would wait for all readers and writers of the
/// table and block later ones.
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
  int newer = 0;  // months with rows
  for (const auto& row : all) {
    const std::string name = work.quote_name(row[0].as<std::string>());
    const bool holds = work.exec1("SELECT EXISTS (SELECT FROM " + name + ")")[0].as<bool>();
    if (row[1].as<bool>() && (!holds || newer >= months)) work.exec("DROP TABLE " + name);
    newer += holds ? 1 : 0;
  }
}

/// One transaction per table, so that no lock is held while waiting for another.
template <class Work>
std::vector<std::string> for_each_table(pqxx::connection& connection, const char* waits,
                                        const char* what, Work act) {
  std::vector<std::string> put_off;
  for (const char* table : kTelemetry) {
    try {
      guarded([&] {
        pqxx::work work(connection);
        work.exec(waits);
        work.exec_params("SELECT pg_advisory_xact_lock($1)", kTablesLock);
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

Store::Store(const StoreConfig& config)
    : impl_(std::make_unique<Impl>(Impl{config, connect(config.connection)})) {
  make_tables(*impl_->connection);
  state_settings(*impl_->connection, config);
}

Store::~Store() = default;

Written Store::write(const Batch& batch) {
  try {
    return write_in_its_month(*impl_->connection, batch);
  } catch (const BadData&) {
    try {
      return write_one_by_one(*impl_->connection, batch);
    } catch (const BadData& bad) {
      throw StoreUnavailable(bad.what());
    }
  }
}

std::vector<std::string> Store::maintain() {
  try {
    std::vector<std::string> put_off = make_months(*impl_->connection);
    for (std::string& words : drop_months(*impl_->connection, impl_->config.telemetry_months))
      put_off.push_back(std::move(words));
    settle(*impl_->connection);
    return put_off;
  } catch (const BadData& bad) {
    throw StoreUnavailable(bad.what());
  }
}

std::vector<Kept> Store::kept(std::int64_t after) {
  std::vector<Kept> all;
  guarded([&] {
    pqxx::read_transaction work(*impl_->connection);
    for (
        const auto& row : work.exec_params(
            "SELECT id, plant, cell, topic, payload, bytes, octet_length(payload) = bytes FROM quarantine WHERE "
            "id > $1 AND why IN ('message', 'bound', 'database') ORDER BY id LIMIT $2",
            after, kAtOnce))
      all.push_back({row[0].as<std::int64_t>(),
                     {row[1].as<std::string>(), row[2].as<std::string>()},
                     row[3].as<std::string>(),
                     pqxx::binarystring(row[4]).str(),
                     row[5].as<std::int64_t>(),
                     row[6].as<bool>()});
  });
  return all;
}

void Store::let_go(std::int64_t kept) {
  guarded([&] {
    pqxx::work work(*impl_->connection);
    work.exec_params("DELETE FROM quarantine WHERE id = $1", kept);
    work.commit();
  });
}

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

Written& Written::operator+=(const Written& other) {
  facts += other.facts;
  twice += other.twice;
  refused += other.refused;
  stored.insert(stored.end(), other.stored.begin(), other.stored.end());
  return *this;
}

}  // namespace cellcal::daemon::fleet
