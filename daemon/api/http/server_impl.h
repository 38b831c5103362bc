#pragma once
// What servers on all kinds of sockets have in common: who is connected, who has to go, what waits.

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <list>
#include <memory>
#include <string>

#include "daemon/api/http/clerk.h"
#include "daemon/api/http/same_site.h"
#include "daemon/api/http/server.h"

namespace cellcal::daemon {

inline constexpr std::size_t kMostConnections = 64;
/// The others are for requests: of those one can always go.
inline constexpr std::size_t kMostStreams = 56;

/// One client. On the context's thread.
class Connection {
 public:
  virtual ~Connection() = default;

  /// What it waits for, the least to be missed first.
  enum class Waits { kForRequest, kForChange, kForClerk, kForReader, kForEvents };
  Waits waits() const { return waits_; }
  /// Where it comes from, to count by; empty: over the Unix socket.
  const std::string& network() const { return network_; }
  /// Name of the token that a stream was opened with; empty without one.
  const std::string& caller() const { return caller_; }

  virtual void start() = 0;
  /// Gives the answer if there is one by now.
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
  /// Whether one more of this caller may follow what happens. Where all places are taken, a caller with at least two fewer
  /// than another gets the newest of that one's: no token keeps the others out.
  bool make_room_for_a_stream(const std::string& caller);
  /// Those who follow are asked for what is new a few times a second, as no change announces all of
  /// it; when poked sooner, but not as often as that may be.
  void keep_looking();
  void ask_all();
  /// Behind an accept that failed.
  void accept_later();

  boost::asio::io_context& context;
  ServerParts parts;
  AnswerBytes answers;
  std::list<std::shared_ptr<Connection>> connections;  ///< the oldest first
  boost::asio::steady_timer beat;
  std::atomic<bool> stopped{false};
  std::atomic<bool> poked{false};
  std::unique_ptr<Clerk> clerk = std::make_unique<Clerk>();  ///< none once it has stopped

 private:
  void make_room();
  void ask_followers();
  void ask_followers_at(std::chrono::steady_clock::time_point when);

  std::chrono::steady_clock::time_point followers_asked_{};
};

/// Throw SocketError. They listen, and accept nothing yet.
std::shared_ptr<HttpServer::Impl> listen_on(boost::asio::io_context& context,
                                            const std::filesystem::path& socket, ServerParts parts);
std::shared_ptr<HttpServer::Impl> listen_on(boost::asio::io_context& context,
                                            const NetworkAddress& address, ServerParts parts);

}  // namespace cellcal::daemon
