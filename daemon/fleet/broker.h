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
  void tell(const plant::Stored& stored);
  /// Acknowledges all received messages; also keeps the connection alive. Throws BrokerUnavailable.
  void acknowledge();

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::daemon::fleet
