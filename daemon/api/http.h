#pragma once
// HTTP/1.1 over a Unix-domain socket: server and client.

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "daemon/api/message.h"

namespace boost::asio {
class io_context;
}

namespace cellcal::daemon {

/// The socket cannot be used: says which, why, and what to do.
struct SocketError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// It belongs to a group that this user is not in.
struct SocketPermissionError : SocketError {
  using SocketError::SocketError;
};

class HttpServer {
 public:
  /// `give_up`: an answer is due now. Otherwise none may be given; it is then asked again after
  /// poke(), and at the latest when the wait is over.
  using Handler = std::function<std::optional<Response>(const Request&, bool give_up)>;
  using Slow = std::function<bool(const Request&)>;

  /// The handler is called on the context's thread, and must keep it for no time; for requests that
  /// are `slow` on a thread of the server's own, one after the other. It is called by both at once.
  /// Throws SocketError. Replaces a socket file that nobody listens on.
  HttpServer(boost::asio::io_context& context, const std::filesystem::path& socket, Handler handler,
             Slow slow = {});
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// Asks again for all answers that wait. From any thread.
  void poke();
  /// Connections are closed, the slow request in hand is waited for, the socket file removed. On
  /// the context's thread.
  void stop();

  struct Impl;

 private:
  std::shared_ptr<Impl> impl_;
};

/// One request, one answer. Throws SocketError (no daemon, no permission, no answer).
Response http_request(const std::filesystem::path& socket, const std::string& method,
                      const std::string& target, const std::string& body = "");

}  // namespace cellcal::daemon
