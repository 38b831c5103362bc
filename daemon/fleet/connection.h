#pragma once
// Within this module: libpqxx, and its errors as ours.

#include <functional>
#include <memory>
#include <pqxx/pqxx>
#include <string>
#include <vector>

#include "daemon/fleet/store.h"

namespace cellcal::daemon::fleet {

/// PostgreSQL does not take these values, now or later.
struct BadData : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// There is no partition for the database's month.
struct NoMonth : BadData {
  using BadData::BadData;
};
/// Others hold what was asked for, and lock_timeout has passed.
struct Locked : StoreUnavailable {
  using StoreUnavailable::StoreUnavailable;
};

/// The same in libpq's words "key='value' ...", so that a database whose computer has gone without a word is noticed within half a minute. What the
/// owner states counts. What libpq cannot read comes back as it is.
std::string with_time_limits(const std::string& connection);

/// UTC, schema fleet, no statement longer than a minute. Throws StoreUnavailable.
std::unique_ptr<pqxx::connection> connect(const std::string& connection);

/// Throws StoreUnavailable (Locked) or BadData (NoMonth) for what libpqxx throws.
void guarded(const std::function<void()>& work);

/// Creates tables and views in an empty database. Throws OtherVersion.
void make_tables(pqxx::connection& connection);
/// Serializes collectors that create or drop tables.
inline constexpr long kTablesLock = 0x63656c6c63616c;  // "cellcal"
/// This month's tables of telemetry and those of the next two. What was put off because others hold it, in words.
std::vector<std::string> make_months(pqxx::connection& connection);
/// Drops what is older than so many months, where as many newer months hold telemetry: a clock that stands years ahead takes little with it.
std::vector<std::string> drop_months(pqxx::connection& connection, int telemetry_months);

}  // namespace cellcal::daemon::fleet
