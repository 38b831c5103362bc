#pragma once
// Internal to this module: libpqxx, with its errors as those of the module.

#include <functional>
#include <memory>
#include <pqxx/pqxx>
#include <string>
#include <vector>

#include "daemon/fleet/store.h"

namespace cellcal::daemon::fleet {

/// PostgreSQL rejects these values permanently.
struct BadData : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// There is no partition for the database's month.
struct NoMonth : BadData {
  using BadData::BadData;
};
/// A table is locked by others, and lock_timeout has passed.
struct Locked : StoreUnavailable {
  using StoreUnavailable::StoreUnavailable;
};

/// The connection in libpq's form "key='value' ..." with time limits, so that a database whose
/// computer fails without notice is detected within half a minute. Stated options take precedence.
/// Returns what libpq cannot parse unchanged.
std::string with_time_limits(const std::string& connection);

/// UTC, schema fleet, no statement longer than a minute. Throws StoreUnavailable.
std::unique_ptr<pqxx::connection> connect(const std::string& connection);

/// Calls `work`. Throws StoreUnavailable (Locked) or BadData (NoMonth) for exceptions of libpqxx.
void guarded(const std::function<void()>& work);

/// The message as one that was refused.
Refused refused_as(const plant::Fact& fact, Refusal why, const std::string& words);
Refused refused_as(const plant::Presence& presence, Refusal why, const std::string& words);

/// Writes one batch in one transaction. Throws StoreUnavailable, BadData; nothing is written then.
Written write_once(pqxx::connection& connection, const Batch& batch);

/// Creates tables and views in an empty database. Throws OtherVersion.
void make_tables(pqxx::connection& connection);
/// Serializes collectors that create or drop tables.
inline constexpr long kTablesLock = 0x63656c6c63616c;  // "cellcal"
/// Creates telemetry tables of this month and the next two. Returns descriptions of those postponed
/// because of a lock.
std::vector<std::string> make_months(pqxx::connection& connection);
/// Drops telemetry older than `telemetry_months`, provided that as many newer months hold
/// telemetry, so that a clock that is years ahead loses little data. Returns as make_months().
std::vector<std::string> drop_months(pqxx::connection& connection, int telemetry_months);

}  // namespace cellcal::daemon::fleet
