#pragma once
// From the broker to the database, until it is told to stop.

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "daemon/fleet/collect/broker.h"
#include "daemon/fleet/store/store.h"
#include "daemon/plant/messages/names.h"

namespace cellcal::daemon::fleet {

struct CollectorConfig {
  BrokerConfig broker;
  StoreConfig store;
  Allowance allowance;
};

/// Since it began. Any thread.
struct Counters {
  std::atomic<std::uint64_t> messages{0}, facts{0}, twice{0}, refused{0}, batches{0};
  std::atomic<std::uint64_t> broker_lost{0}, store_lost{0};
  std::atomic<bool> broker_up{false}, store_up{false};
};

class Collector {
 public:
  explicit Collector(CollectorConfig config);

  /// Returns when `stop` is true. `alive` is called at least every second, but while the database is at work. Throws
  /// OtherVersion.
  void run(
      const std::atomic<bool>& stop, const std::function<void()>& alive = [] {});
  const Counters& counters() const { return counters_; }

 private:
  void serve(Store& store, Broker& broker, const std::atomic<bool>& stop,
             const std::function<void()>& alive);
  /// What is to be told to cells.
  std::vector<plant::Stored> write(Store& store, std::vector<Message> messages);

  void say_put_off(std::vector<std::string> put_off);

  std::vector<std::string> put_off_;  ///< of the last maintenance, as it was said
  CollectorConfig config_;
  Meters meters_;
  Counters counters_;
};

// What is in quarantine, read a second time: by a newer program, or where there is more room.

struct Reread {
  std::size_t stored = 0;   ///< facts and presences that are now taken, and no longer in quarantine
  std::size_t twice = 0;    ///< facts that had come meanwhile; no longer in quarantine
  std::size_t refused = 0;  ///< still, and kept
  std::vector<std::string> cut;  ///< kept in part by an older program; of each its topic and bytes
};

/// Twice is as good as once, and beside collectors at work. Throws StoreAway; what was read by then is done.
Reread reread_quarantine(Store& store);

}  // namespace cellcal::daemon::fleet
