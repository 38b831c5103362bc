#pragma once
// Stores the broker's messages in the database until it is stopped.

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "daemon/fleet/judge.h"
#include "daemon/fleet/store.h"
#include "daemon/plant/messages/presence.h"
#include "daemon/plant/messages/text_fields.h"

namespace cellcal::daemon::fleet {

// Connection to the MQTT broker that acknowledges messages once they are stored.

/// The broker cannot be reached, refuses, or the connection was lost.
struct BrokerUnavailable : std::runtime_error {
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
  /// Connects and subscribes; the session in the broker goes on. Throws BrokerUnavailable.
  explicit Broker(const BrokerConfig& config);
  /// Acknowledges nothing more.
  ~Broker();
  Broker(const Broker&) = delete;
  Broker& operator=(const Broker&) = delete;

  /// Waits for the first message and returns at most `most`. Throws BrokerUnavailable.
  std::vector<Message> receive(std::size_t most, std::chrono::milliseconds wait);
  /// Sent with the next acknowledge(). If it is lost, its cell asks again.
  void report(const plant::Stored& stored);
  /// Acknowledges all received messages; also keeps the connection alive. Throws BrokerUnavailable.
  void acknowledge();

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

struct CollectorConfig {
  BrokerConfig broker;
  StoreConfig store;
  Allowance allowance;
};

/// Counts since construction. Thread-safe.
struct Counters {
  std::atomic<std::uint64_t> messages{0}, facts{0}, twice{0}, refused{0}, batches{0};
  std::atomic<std::uint64_t> broker_lost{0}, store_lost{0};
  std::atomic<bool> broker_up{false}, store_up{false};
};

class Collector {
 public:
  explicit Collector(CollectorConfig config);

  /// Runs until `stop` is true. Calls `alive` at least every second, except during database work.
  /// Throws OtherVersion.
  void run(
      const std::atomic<bool>& stop, const std::function<void()>& alive = [] {});
  const Counters& counters() const { return counters_; }

 private:
  void serve(Store& store, Broker& broker, const std::atomic<bool>& stop,
             const std::function<void()>& alive);
  /// Returns the acknowledgements for the cells.
  std::vector<plant::Stored> write(Store& store, std::vector<Message> messages);

  void log_postponed(std::vector<std::string> put_off);
  /// The first of each cell and reason.
  void log_refused(const std::vector<Refused>& refused);

  std::set<std::tuple<std::string, std::string, Refusal>> named_;
  std::vector<std::string> put_off_;  ///< as logged at the last maintenance
  CollectorConfig config_;
  Meters meters_;
  Counters counters_;
};

// Second reading of quarantined messages, by another version or with more capacity.

struct Reread {
  std::size_t stored = 0;   ///< facts and presences now accepted, and removed from the quarantine
  std::size_t twice = 0;    ///< facts stored meanwhile; removed from quarantine
  std::size_t refused = 0;  ///< still refused and kept
  std::vector<std::string> cut;  ///< truncated by an older program; the topic and bytes of each
};

/// Idempotent; safe with running collectors. Throws StoreUnavailable; messages read until then are done.
Reread reread_quarantine(Store& store);

}  // namespace cellcal::daemon::fleet
