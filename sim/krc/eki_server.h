#pragma once
// The emulated EKI controller in real time, and a TCP server.

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/hard_clock.h"
#include "sim/krc/eki_controller.h"
#include "sim/krc/eki_stream.h"

namespace cellcal::sim {

// A port of the emulated EKI: its socket, and over TCP its single client.

struct BoundSocket {
  int fd = -1;
  std::uint16_t port = 0;
};
/// Non-blocking; TCP listens. Port 0 takes a free one. Throws DriverError naming address and port.
BoundSocket bind_socket(const std::string& address, std::uint16_t port, bool udp);

/// `Peer` handles the client: connect() (false: refused), connected(), receive(bytes),
/// disconnect(), drain_output().
template <class Peer>
class OneClientPort {
 public:
  ~OneClientPort() {
    if (client_ >= 0) ::close(client_);
    if (listener_.fd >= 0) ::close(listener_.fd);
  }

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
    unsent_ += peer.drain_output();
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

struct EkiServerOptions {
  std::string address = "127.0.0.1";
  /// 0: a free one. Empty: from the channel file.
  std::optional<std::uint16_t> port;
  bool realtime = false;  ///< SCHED_FIFO for the clock, if permitted
};

class EkiServer : public InRealTime<EkiController> {
 public:
  EkiServer(EkiControllerConfig config, EkiServerOptions options, CycleHook on_cycle = {});
  ~EkiServer() override { stop(); }

  /// Listens, starts the program and the clock. Throws drivers::DriverError.
  void start();
  /// Cable disconnected: no data in either direction while true, without notification.
  void unplug(bool unplugged) { unplugged_ = unplugged; }
  std::uint16_t port() const { return client_.port(); }
  std::uint64_t refused_clients() const {
    return client_.refused();
  }  ///< while another one was connected

 private:
  void cycle(drivers::TimePoint now) override;

  EkiServerOptions options_;
  OneClientPort<EkiController> client_;
  std::atomic<bool> unplugged_{false};
};

// EkiStream in real time: a TCP listener or UDP socket per channel file.

struct EkiStreamServerOptions {
  std::string address = "127.0.0.1";
  bool free_ports = false;  ///< any free ports instead of the files'
  bool realtime = false;    ///< SCHED_FIFO for the clock, if permitted
};

class EkiStreamServer : public InRealTime<EkiStream> {
 public:
  EkiStreamServer(EkiStreamConfig config, EkiStreamServerOptions options, CycleHook on_cycle = {});
  ~EkiStreamServer() override;

  /// Opens the ports and starts the clock. Throws drivers::DriverError.
  void start();
  std::uint16_t port(std::size_t channel) const;

 private:
  void cycle(drivers::TimePoint now) override;

  struct Endpoint;
  EkiStreamServerOptions options_;
  std::vector<std::unique_ptr<Endpoint>> endpoints_;
};

}  // namespace cellcal::sim
