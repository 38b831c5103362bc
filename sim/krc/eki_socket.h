#pragma once
// A port of the emulated EKI: its socket, and over TCP its single client.

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <string>

namespace cellcal::sim {

struct BoundSocket {
  int fd = -1;
  std::uint16_t port = 0;
};
/// Non-blocking; TCP listens. Port 0 takes a free one. Throws DriverError naming address and port.
BoundSocket bind_socket(const std::string& address, std::uint16_t port, bool udp);

/// `Peer` handles the client: connect() (false: refused), connected(), receive(bytes),
/// disconnect(), take_output().
template <class Peer>
class OneClientPort {
 public:
  OneClientPort() = default;
  ~OneClientPort() {
    if (client_ >= 0) ::close(client_);
    if (listener_.fd >= 0) ::close(listener_.fd);
  }
  OneClientPort(const OneClientPort&) = delete;
  OneClientPort& operator=(const OneClientPort&) = delete;

  bool is_open() const { return listener_.fd >= 0; }
  void open(const std::string& address, std::uint16_t port) {
    listener_ = bind_socket(address, port, false);
    port_ = listener_.port;
  }
  std::uint16_t port() const { return port_.load(); }
  std::uint64_t refused() const { return refused_.load(); }

  /// Accepts clients, and reads data of the connected one.
  void take(Peer& peer) {
    accept_clients(peer);
    while (client_ >= 0) {
      const ssize_t got = ::recv(client_, buffer_.data(), buffer_.size(), 0);
      if (got < 0 && errno == EINTR) continue;
      if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return;
      if (got <= 0) return drop(peer);
      peer.receive({buffer_.data(), static_cast<std::size_t>(got)});
      if (!peer.connected()) return drop(peer);
    }
  }
  /// Buffers the controller's output; a client that does not read it is disconnected.
  void collect(Peer& peer) {
    unsent_ += peer.take_output();
    if (client_ >= 0 && (!peer.connected() || unsent_.size() > kMostUnsent)) drop(peer);
  }
  void give(Peer& peer) {
    while (client_ >= 0 && !unsent_.empty()) {
      const ssize_t sent = ::send(client_, unsent_.data(), unsent_.size(), MSG_NOSIGNAL);
      if (sent < 0 && errno == EINTR) continue;
      if (sent < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return;
      if (sent <= 0) return drop(peer);
      unsent_.erase(0, static_cast<std::size_t>(sent));
    }
    if (client_ < 0) unsent_.clear();
  }

 private:
  static constexpr std::size_t kMostUnsent = 1 << 20;

  void accept_clients(Peer& peer) {
    for (;;) {
      const int fresh = ::accept4(listener_.fd, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
      if (fresh < 0) return;
      if (!peer.connect()) {
        ++refused_;
        ::close(fresh);
        continue;
      }
      if (client_ >= 0) ::close(client_);
      client_ = fresh;
      unsent_.clear();
      const int on = 1;
      (void)::setsockopt(client_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    }
  }

  void drop(Peer& peer) {
    ::close(client_);
    client_ = -1;
    unsent_.clear();
    peer.disconnect();
  }

  BoundSocket listener_;
  int client_ = -1;
  std::array<char, 8192> buffer_{};
  std::string unsent_;
  std::atomic<std::uint16_t> port_{0};
  std::atomic<std::uint64_t> refused_{0};
};

}  // namespace cellcal::sim
