#include "daemon/fleet/store/store.h"

#include "daemon/fleet/store/store_impl.h"
#include "daemon/fleet/store/write.h"
#include "daemon/plant/messages/fact_json.h"

namespace cellcal::daemon::fleet {

namespace {

constexpr double kSettledAfterMin = 5.0;

/// Gaps below a number that was the newest a while ago are no mere disorder. A journal that is being written to waits until the next time: two who
/// lock rows in different orders would wait for each other.
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

/// One message alone.
template <class T>
Batch only(std::vector<T> Batch::*member, const T& one) {
  Batch batch;
  (batch.*member).push_back(one);
  return batch;
}

/// A new database, or one whose clock was set, has no partition for its month.
Written write_in_its_month(pqxx::connection& connection, const Batch& batch) {
  try {
    return write_once(connection, batch);
  } catch (const NoMonth&) {
    make_months(connection);
  }
  try {
    return write_once(connection, batch);
  } catch (const NoMonth& held_by_others) {
    throw StoreAway(held_by_others.what());
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

/// Where PostgreSQL does not take something in it: all but that.
Written write_one_by_one(pqxx::connection& connection, const Batch& batch) {
  using plant::Subject;
  Written written;
  for (const plant::Fact& fact : batch.facts)
    written += write_or_quarantine(
        connection, only(&Batch::facts, fact),
        {fact.of, plant::to_text({fact.of, Subject::kFact, plant::kind_of(fact.body)}),
         plant::to_json(fact), Refusal::kDatabase, ""});
  for (const plant::Presence& presence : batch.presences)
    written +=
        write_or_quarantine(connection, only(&Batch::presences, presence),
                            {presence.of, plant::to_text({presence.of, Subject::kPresence, ""}),
                             plant::to_json(presence), Refusal::kDatabase, ""});
  Batch rest;
  rest.refused = batch.refused;
  rest.too_many = batch.too_many;
  written += write_once(connection, rest);
  return written;
}

}  // namespace

Store::Store(const StoreConfig& config)
    : impl_(std::make_unique<Impl>(Impl{config, connect(config.connection)})) {
  migrate(*impl_->connection, newest_version());
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
      throw StoreAway(bad.what());
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
    throw StoreAway(bad.what());
  }
}

}  // namespace cellcal::daemon::fleet
