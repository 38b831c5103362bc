#pragma once
// A minimal broker with one thread per connection: accepts all clients, acknowledges publications, and sends arbitrary bytes for tests.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace cellcal::daemon::testing {

/// Both trigger an assertion in libmosquitto 2.0.11: a PUBLISH and a PUBACK with an unknown property.
std::vector<std::string> deadly_packets();

class HostileBroker {
 public:
  HostileBroker();
  ~HostileBroker();
  HostileBroker(const HostileBroker&) = delete;
  HostileBroker& operator=(const HostileBroker&) = delete;

  std::uint16_t port() const;
  /// Sends to all open connections with a subscription; returns their number.
  int say(const std::string& bytes);
  /// Sends to each connection when it subscribes, from now on, the result of the function.
  void greet_with(std::function<std::string()> bytes);
  /// Number of subscriptions so far, one per connection.
  int lines() const;
  struct Published {
    std::string topic, payload;
  };
  std::vector<Published> published() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A PUBLISH of quality of service 0.
std::string publish_packet(const std::string& topic, const std::string& payload);

}  // namespace cellcal::daemon::testing
