#pragma once
// Common part of the servers of all socket types: connections, eviction and waiting requests.

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <list>
#include <memory>
#include <string>

#include "daemon/api/http/server.h"

namespace cellcal::daemon {

inline constexpr std::size_t kMostConnections = 64;
/// The remainder is reserved for requests, of which one can always be evicted.
inline constexpr std::size_t kMostStreams = 56;

/// Connection of one client. On the context's thread.
class Connection {
 public:
  virtual ~Connection() = default;

  /// Reason for waiting, ordered from least to most important.
  enum class Waits { kForRequest, kForChange, kForClerk, kForReader, kForEvents };
  Waits waits() const { return waits_; }
  /// Key of the peer's network, for counting; empty: over the Unix socket.
  const std::string& network() const { return network_; }
  /// Token name of a stream; empty without one.
  const std::string& caller() const { return caller_; }

  virtual void start() = 0;
  /// Sends the answer if it is available by now.
  virtual void ask(bool give_up) = 0;
  virtual void close() = 0;

 protected:
  explicit Connection(std::string peer) : peer_(std::move(peer)), network_(network_of(peer_)) {}
  const std::string& peer() const { return peer_; }
  Waits waits_ = Waits::kForRequest;
  std::string caller_;

 private:
  std::string peer_, network_;
};

struct HttpServer::Impl : std::enable_shared_from_this<HttpServer::Impl> {
  Impl(boost::asio::io_context& io, ServerParts given)
      : context(io), parts(std::move(given)), answers(parts.limits.answer_bytes), beat(io) {}
  virtual ~Impl() = default;

  virtual void accept() = 0;
  virtual void stop_listening() = 0;
  virtual std::uint16_t port() const { return 0; }

  void add(const std::shared_ptr<Connection>& connection);
  void remove(const std::shared_ptr<Connection>& connection) { connections.remove(connection); }
  /// Returns true if this caller may open one more stream. Where all slots are taken, a caller that holds at
  /// least two more than this one loses its newest, so that no token can lock out the others.
  bool make_room_for_a_stream(const std::string& caller);
  /// Polls the streams a few times a second, since not every change is announced; earlier after poke(), at a
  /// limited rate.
  void poll_streams();
  void ask_all();
  /// After a failed accept.
  void accept_later();

  boost::asio::io_context& context;
  ServerParts parts;
  AnswerBytes answers;
  std::list<std::shared_ptr<Connection>> connections;  ///< oldest first
  boost::asio::steady_timer beat;
  std::atomic<bool> stopped{false};
  std::atomic<bool> poked{false};
  std::unique_ptr<Clerk> clerk = std::make_unique<Clerk>();  ///< null after stop()

 private:
  void make_room();
  void ask_followers();
  void ask_followers_at(std::chrono::steady_clock::time_point when);

  std::chrono::steady_clock::time_point followers_asked_{};
};

/// Throw SocketError. The result listens but does not accept yet.
std::shared_ptr<HttpServer::Impl> listen_on(boost::asio::io_context& context,
                                            const std::filesystem::path& socket, ServerParts parts);
std::shared_ptr<HttpServer::Impl> listen_on(boost::asio::io_context& context,
                                            const NetworkAddress& address, ServerParts parts);

}  // namespace cellcal::daemon
