#pragma once
// One connection to the plant's database, for writing.

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "daemon/fleet/batch.h"

namespace cellcal::daemon::fleet {

/// The database cannot be reached, or cannot write now; a retry may succeed.
struct StoreUnavailable : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// The tables are those of another version of the program; retrying does not help.
struct OtherVersion : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct StoreConfig {
  std::string connection;     ///< libpq's form: "dbname=cellcal", "postgresql://..."
  int telemetry_months = 13;  ///< kept in addition to the current one
  int calibration_days = 365;
  int check_days = 0;  ///< 0: checks are never overdue
};

/// A quarantined message, as received.
struct Kept {
  std::int64_t id = 0;
  plant::CellName of;
  std::string topic, payload;
  std::int64_t bytes = 0;  ///< of the original message
  bool whole = false;      ///< payload is complete
};

/// For use by one thread.
class Store {
 public:
  /// Connects; creates the tables in an empty database. Throws StoreUnavailable, OtherVersion.
  explicit Store(const StoreConfig& config);
  ~Store();
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;

  /// Writes the batch in one transaction, committed on return. Throws StoreUnavailable.
  Written write(const Batch& batch);
  /// Creates and drops months of telemetry and settles gaps; to be called every few minutes.
  /// Returns descriptions of what a lock postponed. Throws StoreUnavailable.
  std::vector<std::string> maintain();

  /// The oldest few quarantined messages with a larger id than `after` that another version may
  /// accept. Throws StoreUnavailable.
  std::vector<Kept> kept(std::int64_t after);
  /// Removes a message from quarantine, stored or discarded. Throws StoreUnavailable.
  void let_go(std::int64_t kept);

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::daemon::fleet
