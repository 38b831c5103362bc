#pragma once
// An MQTT client of the plant, by libmosquitto: received messages, and permitted publications.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/plant/messages/fact.h"
#include "daemon/plant/messages/presence.h"

namespace cellcal::daemon::testing {

struct Heard {
  std::string topic, payload;
  bool retained = false;
};

struct Login {
  std::string user = {}, password = {}, ca = {};
};

class Listener {
 public:
  /// Subscribed on return, in a session that outlives broker and connection. Empty `subscribe`: no subscription.
  Listener(std::uint16_t port, const std::string& id, const std::string& subscribe,
           const Login& login = {});
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  /// All messages once `enough` is true; throws an exception on timeout.
  std::vector<Heard> until(const std::function<bool(const std::vector<Heard>&)>& enough) const;
  std::vector<Heard> all() const;
  /// With everything that the broker has acknowledged to anyone before the call.
  std::vector<Heard> all_acknowledged();
  /// The reason code of its PUBACK; none: the broker ended the connection.
  std::optional<int> say(const std::string& topic, const std::string& payload,
                         bool retained = false);
  /// Acknowledges all facts, past and future, as `stored`, like a collector.
  void store();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Facts among the messages; throws if one is invalid.
std::vector<plant::Fact> facts_in(const std::vector<Heard>& heard);
/// The newest presence.
std::optional<plant::Presence> presence_in(const std::vector<Heard>& heard);

}  // namespace cellcal::daemon::testing
