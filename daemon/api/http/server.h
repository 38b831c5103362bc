#pragma once
// The HTTP/1.1 server, on a Unix-domain socket or on the network, there with TLS or without.

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "daemon/api/http/http.h"
#include "daemon/api/http/message.h"

namespace boost::asio {
class io_context;
}

namespace cellcal::daemon {

/// An address of this computer, and what TLS needs. Without both files there is none.
struct NetworkAddress {
  std::string address;                                 ///< IPv4 or IPv6
  std::uint16_t port = 0;                              ///< 0: any that is free
  std::filesystem::path tls_certificate{}, tls_key{};  ///< PEM; the certificate with its chain
};

/// Reads certificate and key, where there are any. Throws SocketError as a server would.
void check_tls(const NetworkAddress& address);

inline constexpr std::size_t kMostBody = std::size_t{64} << 10;
/// How long a client may take, and how much it and its answers.
struct ServerLimits {
  /// From the connection, or the answer before, until the request is there as a whole; for the
  /// handshake of TLS as much again.
  std::chrono::milliseconds request{5'000};
  std::chrono::milliseconds answer{30'000};
  /// One who follows, until he has taken what he was last given.
  std::chrono::milliseconds follower{10'000};
  /// What asks over the network for something to be done is not done once it has waited longer behind others.
  std::chrono::milliseconds queue{10'000};
  /// Of a request.
  std::size_t body = kMostBody;
  /// Large answers that are made and not yet taken, of all clients together (AnswerBytes).
  std::size_t answer_bytes = std::size_t{64} << 20;
};

struct ServerParts {
  /// Says who asks (Request::caller), or refuses. On the context's thread, for no time.
  std::function<std::optional<Response>(Request&)> admit;
  /// `give_up`: an answer is due now. Otherwise none may be given; it is then asked again after
  /// poke(), and at the latest when the wait is over. On the context's thread, for no time; for
  /// requests that are `slow` on a thread of the server's own, one after the other. It is called by
  /// both at once.
  std::function<std::optional<Response>(const Request&, bool give_up)> handler;
  std::function<bool(const Request&)> slow{};
  ServerLimits limits{};
};

class HttpServer {
 public:
  /// Throws SocketError. Replaces a socket file that nobody listens on.
  HttpServer(boost::asio::io_context& context, const std::filesystem::path& socket,
             ServerParts parts);
  /// Throws SocketError, also for a certificate and a key that cannot be used.
  HttpServer(boost::asio::io_context& context, const NetworkAddress& address, ServerParts parts);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// Asks again for all answers that wait, and streams for what is new. From any thread.
  void poke();
  /// Connections are closed, the slow request in hand is waited for, a socket file removed. On the
  /// context's thread.
  void stop();
  /// Where it listens; 0 on a Unix socket.
  std::uint16_t port() const;

  struct Impl;

 private:
  std::shared_ptr<Impl> impl_;
};

}  // namespace cellcal::daemon
