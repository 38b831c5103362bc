#pragma once
// HTTP/1.1 server on a Unix-domain socket or on the network, there with or without TLS.

#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "daemon/api/http/http.h"
#include "daemon/runner/runner.h"

namespace cellcal::daemon {

/// Listening address and TLS files. Without both files, no TLS.
struct NetworkAddress {
  std::string address;                                 ///< IPv4 or IPv6
  std::uint16_t port = 0;                              ///< 0: any free port
  std::filesystem::path tls_certificate{}, tls_key{};  ///< PEM; the certificate includes its chain
};

/// Loads certificate and key, if any. Throws SocketError as the server does.
void check_tls(const NetworkAddress& address);

inline constexpr std::size_t kMostBody = std::size_t{64} << 10;
/// Limits of time and memory per client.
struct ServerLimits {
  /// From the connection or the previous answer to the complete request; the TLS handshake has the same limit
  /// in addition.
  std::chrono::milliseconds request{5'000};
  /// The same for a request with a file.
  std::chrono::milliseconds upload{60'000};
  std::chrono::milliseconds answer{30'000};
  /// A follower, until it has read the last piece.
  std::chrono::milliseconds follower{10'000};
  /// A network request for an action is dropped after waiting this long in the queue.
  std::chrono::milliseconds queue{10'000};
  /// Size of a request body [bytes].
  std::size_t body = kMostBody;
  /// Large answers not yet read, of all clients together (AnswerBytes) [bytes].
  std::size_t answer_bytes = std::size_t{64} << 20;
};

struct ServerParts {
  /// Sets Request::caller, or returns the refusal. Called on the context's thread; must not block.
  std::function<std::optional<Response>(Request&)> admit;
  /// `give_up`: an answer is due now. Otherwise none may be returned; the handler is then called again after
  /// poke(), at the latest at the end of the wait. Called on the context's thread, where it must not block;
  /// for `slow` requests on a thread of the server's own, one after the other. Both may call it concurrently.
  std::function<std::optional<Response>(const Request&, bool give_up)> handler;
  std::function<bool(const Request&)> slow{};
  ServerLimits limits{};
  /// Limit for requests that carry a file, without their body [bytes]; 0: ServerLimits::body. They are admitted before
  /// their body is read.
  std::function<std::size_t(const Request&)> largest_body{};
};

class HttpServer {
 public:
  /// Throws SocketError. Replaces a stale socket file.
  HttpServer(boost::asio::io_context& context, const std::filesystem::path& socket,
             ServerParts parts);
  /// Throws SocketError, also for an unusable certificate or key.
  HttpServer(boost::asio::io_context& context, const NetworkAddress& address, ServerParts parts);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// Re-evaluates pending answers and streams. Thread-safe.
  void poke();
  /// Closes all connections, waits for the current slow request and removes the socket file. To be called on
  /// the context's thread.
  void stop();
  /// Port of the listener; 0 for a Unix socket.
  std::uint16_t port() const;

  struct Impl;

 private:
  std::shared_ptr<Impl> impl_;
};

/// Server with a thread of its own: its load does not affect the thread that takes aborts from the Unix socket and
/// signals and feeds the watchdog.
class ServerThread {
 public:
  /// Throws SocketError. `nice`: of the thread.
  ServerThread(const std::filesystem::path& socket, ServerParts parts, int nice = 0);
  ServerThread(const NetworkAddress& address, ServerParts parts);
  ~ServerThread() { stop(); }
  ServerThread(const ServerThread&) = delete;
  ServerThread& operator=(const ServerThread&) = delete;

  /// As those of HttpServer; thread-safe.
  void poke() { server_.poke(); }
  std::uint16_t port() const { return server_.port(); }
  /// Closes all connections and waits for the current request.
  void stop();

 private:
  boost::asio::io_context context_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_{
      context_.get_executor()};
  HttpServer server_;
  std::thread thread_;
};

// Thread for slow requests: one after the other, with bounded queues per caller.
//
// Acting requests (such as starting a session) precede reading ones and have slots of their own, which
// neither readers nor a single token can exhaust.

/// Thread-safe. Destruction waits for the current job and drops the others.
class Clerk {
 public:
  // Limits of the waiting requests.
  static constexpr std::size_t kMostReading = 48, kMostReadingOfOne = 24;
  static constexpr std::size_t kMostActing = 16, kMostActingOfOne = 8;

  /// False: queue full.
  bool post(const Request& request, std::function<void()> job);

 private:
  struct Waiting {
    std::string name;
    std::function<void()> job;
  };
  void do_next();

  std::mutex mutex_;
  std::deque<Waiting> acting_, reading_;
  /// Declared last, destroyed first: it uses the other members.
  ThreadWorker worker_{ThreadWorker::Priority::kNormal};
};

// Memory bound for answers that are complete but not yet read by their clients.
//
// Sixty slow readers of the largest export would hold it sixty times. Small answers are always permitted: the
// number of connections is limited, which bounds them too.

/// Thread-safe.
class AnswerBytes {
 public:
  static constexpr std::size_t kSmall = std::size_t{1} << 20;

  explicit AnswerBytes(std::size_t most) : most_(most) {}

  /// Reserves that many bytes until the result is released. Null: no memory left. An answer larger than the
  /// whole budget is permitted alone.
  std::shared_ptr<void> hold(std::size_t bytes) {
    const std::size_t counted = bytes <= kSmall ? 0 : bytes;
    std::size_t before = *held_;
    do {
      if (counted > 0 && before > 0 && before + counted > most_) return nullptr;
    } while (!held_->compare_exchange_weak(before, before + counted));
    return {held_.get(), [held = held_, counted](void*) { *held -= counted; }};
  }

 private:
  std::size_t most_;
  /// Shared: a connection may outlive its server
  std::shared_ptr<std::atomic<std::size_t>> held_ = std::make_shared<std::atomic<std::size_t>>(0);
};

}  // namespace cellcal::daemon
