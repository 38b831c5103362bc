#pragma once
// A broker by hand, of one thread a line: it takes whoever comes and acknowledges what is published, and says whatever bytes a test wants.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace cellcal::daemon::testing {

/// Both end libmosquitto 2.0.11 by an assertion: a PUBLISH and a PUBACK with a property that MQTT does not know.
std::vector<std::string> deadly_packets();

class HostileBroker {
 public:
  HostileBroker();
  ~HostileBroker();
  HostileBroker(const HostileBroker&) = delete;
  HostileBroker& operator=(const HostileBroker&) = delete;

  std::uint16_t port() const;
  /// To all lines that are open and have subscribed; how many those are.
  int say(const std::string& bytes);
  /// To each line that subscribes from now on, as many as the function has words for.
  void greet_with(std::function<std::string()> bytes);
  /// Lines that have subscribed so far.
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
