#pragma once
// A door for strangers, on a thread of its own: whatever they send there, the thread that takes
// an abort from the Unix socket and from signals, and feeds the watchdog, has nothing to do with it.

#include <filesystem>
#include <functional>
#include <memory>

#include "daemon/api/handlers.h"
#include "daemon/api/http/server.h"
#include "daemon/config/http_config.h"

namespace cellcal::daemon {

NetworkAddress address_of(const HttpConfig& config);

class NetworkDoor {
 public:
  /// The API over the network. Throws SocketError.
  NetworkDoor(const HttpConfig& config, Api& api);
  /// Of the line to the plant: a socket on which nothing but these answers is to be had. Throws SocketError.
  NetworkDoor(const std::filesystem::path& socket, std::function<Response(const Request&)> answer);
  ~NetworkDoor();
  NetworkDoor(const NetworkDoor&) = delete;
  NetworkDoor& operator=(const NetworkDoor&) = delete;

  /// As HttpServer; from any thread.
  void poke();
  /// Closes all connections and waits for the request in hand.
  void stop();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::daemon
