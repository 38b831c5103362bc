#pragma once
// A collector in a thread of the test.

#include <atomic>
#include <string>
#include <thread>

#include "daemon/fleet/collector.h"
#include "tests/daemon/fleet/servers.h"

namespace cellcal::daemon::fleet::testing {

inline CollectorConfig config_of(const MqttBroker& broker, const std::string& database,
                                 const std::string& client = "one") {
  CollectorConfig config;
  config.broker.host = "127.0.0.1";
  config.broker.port = broker.port();
  config.broker.client = client;
  config.store.connection = database;
  return config;
}

/// Ready after construction.
class Running {
 public:
  explicit Running(const CollectorConfig& config)
      : collector_(config), thread_([this] { collector_.run(stop_); }) {
    within_reach([this] { return counters().broker_up.load(); });
  }
  ~Running() {
    stop_ = true;
    thread_.join();
  }
  const Counters& counters() const { return collector_.counters(); }

 private:
  Collector collector_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace cellcal::daemon::fleet::testing
