#pragma once
// Within this room: libpqxx, and its errors as ours.

#include <functional>
#include <memory>
#include <pqxx/pqxx>
#include <string>

#include "daemon/fleet/store/store.h"

namespace cellcal::daemon::fleet {

/// PostgreSQL does not take these values, now or later.
struct BadData : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// UTC, schema fleet, no statement longer than a minute. Throws StoreAway.
std::unique_ptr<pqxx::connection> connect(const std::string& connection);

/// Throws StoreAway or BadData for what libpqxx throws.
void guarded(const std::function<void()>& work);

void migrate(pqxx::connection& connection, int version);
/// Of the whole plant: one collector at a time does it.
inline constexpr long kMigrationLock = 0x63656c6c63616c;  // "cellcal"
void maintain_partitions(pqxx::connection& connection, int telemetry_months);

}  // namespace cellcal::daemon::fleet
