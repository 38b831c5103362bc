#pragma once
// Connection to the MQTT broker that acknowledges messages once they are stored.

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "daemon/fleet/judge.h"
#include "daemon/plant/messages/presence.h"
#include "daemon/plant/messages/text_fields.h"

namespace cellcal::daemon::fleet {

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
  std::string group;   ///< shared by collectors that share messages; empty: all messages (README)
  std::string client;  ///< unique among collectors
};

/// For use by one thread.
class Broker {
 public:
  /// Connects and subscribes, resuming the broker's session. Throws BrokerUnavailable.
  explicit Broker(const BrokerConfig& config);
  /// Acknowledges nothing more.
  ~Broker();
  Broker(const Broker&) = delete;
  Broker& operator=(const Broker&) = delete;

  /// Waits for the first message and returns at most `most`. Throws BrokerUnavailable.
  std::vector<Message> receive(std::size_t most, std::chrono::milliseconds wait);
  /// Queues an answer for the next acknowledge(). If it is lost, the cell asks again.
  void tell(const plant::Stored& stored);
  /// Acknowledges all received messages; also keeps the connection alive. Throws BrokerUnavailable.
  void acknowledge();

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::daemon::fleet
