#include "sim/krc/eki_server.h"

#include <arpa/inet.h>

#include <atomic>
#include <cstring>
#include <mutex>
#include <thread>

#include "drivers/error.h"
#include "sim/hard_clock.h"

namespace cellcal::sim {

using drivers::TimePoint;

struct EkiServer::Impl {
  Impl(EkiControllerConfig config, EkiServerOptions o, CycleHook hook)
      : options(std::move(o)), on_cycle(std::move(hook)), controller(std::move(config)) {}

  void run() {
    if (options.realtime) request_hardware_priority();
    TimePoint next = std::chrono::steady_clock::now();
    while (!stopping.load()) {
      next += controller.cycle();
      sleep_until(next);
      const std::lock_guard lock(mutex);
      cycle(next);
    }
  }

  void cycle(TimePoint now) {
    const bool cable = !unplugged.load();
    if (cable) client.take(controller);
    controller.tick(now);
    if (on_cycle) on_cycle(controller, now);
    client.collect(controller);
    if (cable) client.give(controller);
  }

  EkiServerOptions options;
  CycleHook on_cycle;
  std::mutex mutex;
  EkiController controller;
  OneClientPort<EkiController> client;
  std::atomic<bool> stopping{false}, unplugged{false};
  std::thread thread;
};

EkiServer::EkiServer(EkiControllerConfig config, EkiServerOptions options, CycleHook on_cycle)
    : impl_(std::make_unique<Impl>(std::move(config), std::move(options), std::move(on_cycle))) {}

EkiServer::~EkiServer() { stop(); }

void EkiServer::start() {
  if (impl_->thread.joinable()) return;
  if (!impl_->client.is_open()) {
    impl_->client.open(impl_->options.address,
                       impl_->options.port.value_or(impl_->controller.channel().config().port));
  }
  impl_->stopping = false;
  impl_->controller.start_program();
  impl_->thread = std::thread([impl = impl_.get()] { impl->run(); });
}

void EkiServer::stop() {
  impl_->stopping = true;
  if (impl_->thread.joinable()) impl_->thread.join();
}

void EkiServer::with(const std::function<void(EkiController&)>& use) {
  const std::lock_guard lock(impl_->mutex);
  use(impl_->controller);
}

void EkiServer::unplug(bool unplugged) { impl_->unplugged = unplugged; }
std::uint16_t EkiServer::port() const { return impl_->client.port(); }
std::uint64_t EkiServer::refused_clients() const { return impl_->client.refused(); }

namespace {

/// One channel on its socket.
struct Endpoint {
  Endpoint(EkiStream& k, std::size_t i) : krc(k), index(i), udp(channel().config().udp) {}
  ~Endpoint() {
    if (datagrams.fd >= 0) ::close(datagrams.fd);
  }
  Endpoint(const Endpoint&) = delete;
  Endpoint& operator=(const Endpoint&) = delete;

  EkiChannel& channel() { return krc.channel(index); }
  bool is_open() const { return udp ? datagrams.fd >= 0 : client.is_open(); }
  std::uint16_t port() const { return udp ? datagrams.port : client.port(); }

  void open(const EkiStreamServerOptions& options) {
    const std::uint16_t wanted = options.free_ports ? 0 : channel().config().port;
    if (udp) {
      datagrams = bind_socket(options.address, wanted, true);
    } else {
      client.open(options.address, wanted);
    }
  }

  void take() {
    if (!udp) return client.take(channel());
    for (;;) {
      socklen_t size = sizeof peer;
      const ssize_t got = ::recvfrom(datagrams.fd, buffer.data(), buffer.size(), 0,
                                     reinterpret_cast<sockaddr*>(&peer), &size);
      // ECONNREFUSED: result of an earlier state sent to a disconnected client.
      if (got < 0 && (errno == EINTR || errno == ECONNREFUSED)) continue;
      if (got < 0) return;
      krc.datagram(index, {buffer.data(), static_cast<std::size_t>(got)});
    }
  }

  void give() {
    if (!udp) {
      client.collect(channel());
      return client.give(channel());
    }
    const std::string state = channel().drain_output();
    if (state.empty()) return;
    (void)::sendto(datagrams.fd, state.data(), state.size(), 0, reinterpret_cast<sockaddr*>(&peer),
                   sizeof peer);
  }

  EkiStream& krc;
  std::size_t index;
  bool udp;
  OneClientPort<EkiChannel> client;
  BoundSocket datagrams;
  sockaddr_in peer{};
  std::array<char, 8192> buffer{};
};

}  // namespace

struct EkiStreamServer::Impl {
  Impl(EkiStreamConfig config, EkiStreamServerOptions o, CycleHook hook)
      : options(std::move(o)), on_cycle(std::move(hook)), krc(std::move(config)) {
    for (std::size_t i = 0; i < krc.channels(); ++i)
      endpoints.push_back(std::make_unique<Endpoint>(krc, i));
  }

  void run() {
    if (options.realtime) request_hardware_priority();
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
    if (!endpoint->is_open()) endpoint->open(impl_->options);
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
  return impl_->endpoints.at(channel)->port();
}

BoundSocket bind_socket(const std::string& address, std::uint16_t port, bool udp) {
  constexpr int kBacklog = 4;
  sockaddr_in here{};
  here.sin_family = AF_INET;
  here.sin_port = htons(port);
  if (inet_pton(AF_INET, address.c_str(), &here.sin_addr) != 1) {
    throw drivers::DriverError("emulated EKI controller: \"" + address +
                               "\" is not an IPv4 address");
  }
  const int fd =
      ::socket(AF_INET, (udp ? SOCK_DGRAM : SOCK_STREAM) | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const int on = 1;
  socklen_t size = sizeof here;
  if (fd < 0 || (!udp && ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) != 0) ||
      ::bind(fd, reinterpret_cast<sockaddr*>(&here), sizeof here) != 0 ||
      (!udp && ::listen(fd, kBacklog) != 0) ||
      ::getsockname(fd, reinterpret_cast<sockaddr*>(&here), &size) != 0) {
    const std::string why = std::strerror(errno);
    if (fd >= 0) ::close(fd);
    throw drivers::DriverError("emulated EKI controller: cannot open " +
                               std::string(udp ? "UDP " : "TCP ") + address + ":" +
                               std::to_string(port) + ": " + why);
  }
  return {fd, ntohs(here.sin_port)};
}

}  // namespace cellcal::sim
