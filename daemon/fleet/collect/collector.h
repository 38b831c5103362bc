#pragma once
// From the broker to the database, until it is told to stop.

#include <atomic>
#include <cstdint>
#include <functional>

#include "daemon/fleet/collect/broker.h"
#include "daemon/fleet/collect/meters.h"
#include "daemon/fleet/store/store.h"

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
  /// StoreTooNew.
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

}  // namespace cellcal::daemon::fleet
