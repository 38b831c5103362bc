#pragma once
// One connection to the plant's database, for writing.

#include <cstdint>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "calib/model/enum_table.h"
#include "daemon/plant/messages/fact.h"
#include "daemon/plant/messages/presence.h"

namespace cellcal::daemon::fleet {

// A batch, and the reason of its refusal.

enum class Refusal {
  kTopic,    ///< none of ours
  kSize,     ///< too large to be read
  kRate,     ///< its cell sends more than it may
  kMessage,  ///< damaged, of an unknown kind, or another cell's
  kBound,    ///< more cells than a plant has, more journals or more scattered numbers than a cell
  kDatabase  ///< PostgreSQL does not take it
};
constexpr const char* to_string(Refusal refusal) { return own_name(refusal); }

struct Refused {
  plant::CellName of;  ///< by its topic; empty: none
  std::string topic, payload;
  Refusal why = Refusal::kMessage;
  std::string words;
};

struct Batch {
  std::vector<plant::Fact> facts;
  std::vector<plant::Presence> presences;
  std::vector<Refused> refused;
  /// Refused for Refusal::kRate: counted, and not kept.
  std::map<plant::CellName, std::size_t> too_many;

  bool empty() const {
    return facts.empty() && presences.empty() && refused.empty() && too_many.empty();
  }
};

struct Written {
  std::size_t facts = 0;    ///< that are new
  std::size_t twice = 0;    ///< that were there already
  std::size_t refused = 0;  ///< of the batch, and by the database
  /// Of each journal of which the batch had results, new or not: what is stored of it, once this is committed.
  std::vector<plant::Stored> stored = {};

  Written& operator+=(const Written& other);
};

/// The database cannot be reached, or cannot write now. What was asked for may be asked again.
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
