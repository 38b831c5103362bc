#pragma once
// A connection to the MQTT broker whose messages are acknowledged when they are stored.

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "daemon/fleet/collect/judge.h"
#include "daemon/plant/messages/names.h"
#include "daemon/plant/messages/presence.h"

namespace cellcal::daemon::fleet {

// How much each cell may send. Each has a store of messages and of bytes that fills by time.

struct Allowance {
  double messages_per_s = 20.0;
  double burst = 50'000.0;  ///< messages; a week offline with one health fact a minute has 10 080
  double bytes_per_day = 1.0e9;  ///< as many at once, too
};

/// One thread.
class Meters {
 public:
  using Time = std::chrono::steady_clock::time_point;

  explicit Meters(Allowance allowance) : allowance_(allowance) {}
  /// False: it has used up what it may. A message without a cell counts to one that all such share.
  bool allows(const plant::CellName& cell, std::size_t bytes, Time now);

 private:
  struct Meter {
    double messages = 0.0, bytes = 0.0;  ///< left
    Time at;
  };
  Meter& meter_of(const plant::CellName& cell, Time now);

  Allowance allowance_;
  std::map<plant::CellName, Meter> meters_;
};

/// The broker cannot be reached, refuses, or the connection was lost.
struct BrokerAway : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct BrokerConfig {
  std::string host = "localhost";
  std::uint16_t port = 1883;
  bool tls = false;
  std::filesystem::path ca, certificate, key;  ///< ca empty: the system's
  std::string user;
  std::filesystem::path password_file;  ///< its first line
  std::string group;   ///< collectors of one share the messages; empty: this one has all (README)
  std::string client;  ///< no two collectors have the same
};

/// One thread.
class Broker {
 public:
  /// Connects and subscribes; the session in the broker goes on. Throws BrokerAway.
  explicit Broker(const BrokerConfig& config);
  /// Acknowledges nothing more.
  ~Broker();
  Broker(const Broker&) = delete;
  Broker& operator=(const Broker&) = delete;

  /// What has come, `most` messages at most; waits for the first. Throws BrokerAway.
  std::vector<Message> receive(std::size_t most, std::chrono::milliseconds wait);
  /// Goes out with the next acknowledge(). What is lost on the way is asked for again by its cell.
  void tell(const plant::Stored& stored);
  /// All that receive() gave; keeps the connection alive, too. Throws BrokerAway.
  void acknowledge();

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::daemon::fleet
