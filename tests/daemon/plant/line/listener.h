#pragma once
// Somebody in the plant, by libmosquitto: what it hears, and what it may say.

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
  /// Subscribed when it returns, in a session that outlives broker and connection. `subscribe` empty: to nothing.
  Listener(std::uint16_t port, const std::string& id, const std::string& subscribe, const Login& login = {});
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  /// All until `enough` says so; fails by an exception where that never comes.
  std::vector<Heard> until(const std::function<bool(const std::vector<Heard>&)>& enough) const;
  std::vector<Heard> all() const;
  /// The reason of its PUBACK; none: the broker ended the connection.
  std::optional<int> say(const std::string& topic, const std::string& payload, bool retained = false);
  /// From now on, of what comes and came, as a collector does: `stored` of each fact.
  void store();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Of what was heard; throws where one is none.
std::vector<plant::Fact> facts_in(const std::vector<Heard>& heard);
/// The newest.
std::optional<plant::Presence> presence_in(const std::vector<Heard>& heard);

}  // namespace cellcal::daemon::testing
