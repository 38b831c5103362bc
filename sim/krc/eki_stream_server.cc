#include "sim/krc/eki_stream_server.h"

#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <pthread.h>
#include <sched.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <thread>

#include "drivers/error.h"

namespace cellcal::sim {
namespace {

using drivers::TimePoint;

// As the other emulated controllers: it stands for hardware.
constexpr int kPriority = 70;
constexpr int kBacklog = 4;
// A client that does not read: its states wait here, and then it is dropped.
constexpr std::size_t kMostUnsent = 1 << 20;

void sleep_until(TimePoint t) {
  const auto ns =
      std::chrono::duration_cast<std::chrono::nanoseconds>(t.time_since_epoch()).count();
  const timespec until{ns / 1'000'000'000, ns % 1'000'000'000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

/// One channel on its socket.
struct Endpoint {
  Endpoint(EkiStream& k, std::size_t i) : krc(k), index(i), udp(channel().config().udp) {}
  ~Endpoint() {
    if (client >= 0) ::close(client);
    if (socket >= 0) ::close(socket);
  }
  Endpoint(const Endpoint&) = delete;
  Endpoint& operator=(const Endpoint&) = delete;

  EkiChannel& channel() { return krc.channel(index); }

  void open(const EkiStreamServerOptions& options) {
    sockaddr_in here{};
    here.sin_family = AF_INET;
    here.sin_port = htons(options.free_ports ? 0 : channel().config().port);
    if (inet_pton(AF_INET, options.address.c_str(), &here.sin_addr) != 1) {
      throw drivers::DriverError("emulated EKI controller: \"" + options.address +
                                 "\" is not an IPv4 address");
    }
    socket = ::socket(AF_INET, (udp ? SOCK_DGRAM : SOCK_STREAM) | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    const int on = 1;
    socklen_t size = sizeof here;
    if (socket < 0 ||
        (!udp && ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) != 0) ||
        ::bind(socket, reinterpret_cast<sockaddr*>(&here), sizeof here) != 0 ||
        (!udp && ::listen(socket, kBacklog) != 0) ||
        ::getsockname(socket, reinterpret_cast<sockaddr*>(&here), &size) != 0) {
      throw drivers::DriverError("emulated EKI controller: cannot open " +
                                 std::string(udp ? "UDP " : "TCP ") + options.address + ":" +
                                 std::to_string(ntohs(here.sin_port)) + ": " +
                                 std::strerror(errno));
    }
    port = ntohs(here.sin_port);
  }

  void take() {
    if (udp) return take_datagrams();
    for (int fresh;
         (fresh = ::accept4(socket, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC)) >= 0;) {
      if (!channel().connect()) {
        ::close(fresh);
        continue;
      }
      client = fresh;
      unsent.clear();
      const int on = 1;
      (void)::setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    }
    while (client >= 0) {
      const ssize_t got = ::recv(client, buffer.data(), buffer.size(), 0);
      if (got < 0 && errno == EINTR) continue;
      if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return;
      if (got <= 0) return drop();
      channel().receive({buffer.data(), static_cast<std::size_t>(got)});
      if (!channel().connected()) return drop();
    }
  }

  void take_datagrams() {
    for (;;) {
      socklen_t size = sizeof peer;
      const ssize_t got = ::recvfrom(socket, buffer.data(), buffer.size(), 0,
                                     reinterpret_cast<sockaddr*>(&peer), &size);
      // ECONNREFUSED: what an earlier state met at a client that has gone.
      if (got < 0 && (errno == EINTR || errno == ECONNREFUSED)) continue;
      if (got < 0) return;
      krc.datagram(index, {buffer.data(), static_cast<std::size_t>(got)});
    }
  }

  void give() {
    if (udp) {
      const std::string state = channel().take_output();
      if (!state.empty()) {
        (void)::sendto(socket, state.data(), state.size(), 0, reinterpret_cast<sockaddr*>(&peer),
                       sizeof peer);
      }
      return;
    }
    unsent += channel().take_output();
    if (client >= 0 && (!channel().connected() || unsent.size() > kMostUnsent)) drop();
    while (client >= 0 && !unsent.empty()) {
      const ssize_t sent = ::send(client, unsent.data(), unsent.size(), MSG_NOSIGNAL);
      if (sent < 0 && errno == EINTR) continue;
      if (sent < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return;
      if (sent <= 0) return drop();
      unsent.erase(0, static_cast<std::size_t>(sent));
    }
  }

  void drop() {
    ::close(client);
    client = -1;
    unsent.clear();
    channel().disconnect();
  }

  EkiStream& krc;
  std::size_t index;
  bool udp;
  int socket = -1, client = -1;
  std::uint16_t port = 0;
  sockaddr_in peer{};
  std::array<char, 8192> buffer{};
  std::string unsent;
};

}  // namespace

struct EkiStreamServer::Impl {
  Impl(EkiStreamConfig config, EkiStreamServerOptions o, CycleHook hook)
      : options(std::move(o)), on_cycle(std::move(hook)), krc(std::move(config)) {
    for (std::size_t i = 0; i < krc.channels(); ++i)
      endpoints.push_back(std::make_unique<Endpoint>(krc, i));
  }

  void run() {
    if (options.realtime) {
      sched_param param{};
      param.sched_priority = kPriority;
      (void)pthread_setschedparam(pthread_self(), SCHED_FIFO, &param);
    }
    TimePoint next = std::chrono::steady_clock::now();
    while (!stopping.load()) {
      next += krc.cycle();
      sleep_until(next);
      const std::lock_guard lock(mutex);
      for (const auto& endpoint : endpoints) endpoint->take();
      krc.tick(next);
      if (on_cycle) on_cycle(krc, next);
      for (const auto& endpoint : endpoints) endpoint->give();
    }
  }

  EkiStreamServerOptions options;
  CycleHook on_cycle;
  std::mutex mutex;
  EkiStream krc;
  std::vector<std::unique_ptr<Endpoint>> endpoints;
  std::atomic<bool> stopping{false};
  std::thread thread;
};

EkiStreamServer::EkiStreamServer(EkiStreamConfig config, EkiStreamServerOptions options,
                                 CycleHook on_cycle)
    : impl_(std::make_unique<Impl>(std::move(config), std::move(options), std::move(on_cycle))) {}
EkiStreamServer::~EkiStreamServer() { stop(); }

void EkiStreamServer::start() {
  if (impl_->thread.joinable()) return;
  for (const auto& endpoint : impl_->endpoints) {
    if (endpoint->socket < 0) endpoint->open(impl_->options);
  }
  impl_->stopping = false;
  impl_->thread = std::thread([impl = impl_.get()] { impl->run(); });
}

void EkiStreamServer::stop() {
  impl_->stopping = true;
  if (impl_->thread.joinable()) impl_->thread.join();
}

void EkiStreamServer::with(const std::function<void(EkiStream&)>& use) {
  const std::lock_guard lock(impl_->mutex);
  use(impl_->krc);
}

std::uint16_t EkiStreamServer::port(std::size_t channel) const {
  return impl_->endpoints.at(channel)->port;
}

}  // namespace cellcal::sim
