#pragma once
// Listener for external clients, on a thread of its own: its load does not affect the thread that takes
// aborts from the Unix socket and signals and feeds the watchdog.

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <filesystem>
#include <functional>
#include <thread>

#include "daemon/api/handlers.h"
#include "daemon/api/http/server.h"
#include "daemon/config/network_config.h"

namespace cellcal::daemon {

NetworkAddress address_of(const HttpConfig& config);

class NetworkServer {
 public:
  /// Network API. Throws SocketError.
  NetworkServer(const HttpConfig& config, Api& api);
  /// Socket for the process with the line to the plant, limited to these answers. Throws SocketError.
  NetworkServer(const std::filesystem::path& socket,
                std::function<Response(const Request&)> answer);
  ~NetworkServer() { stop(); }
  NetworkServer(const NetworkServer&) = delete;
  NetworkServer& operator=(const NetworkServer&) = delete;

  /// As HttpServer::poke(); thread-safe.
  void poke() { server_.poke(); }
  /// Closes all connections and waits for the current request.
  void stop();

 private:
  boost::asio::io_context context_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_{
      context_.get_executor()};
  HttpServer server_;
  std::thread thread_;
};

}  // namespace cellcal::daemon
