#include "sim/krc/eki_server.h"

#include <arpa/inet.h>

#include <cstring>

#include "drivers/error.h"

namespace cellcal::sim {

using drivers::TimePoint;

EkiServer::EkiServer(EkiControllerConfig config, EkiServerOptions options, CycleHook on_cycle)
    : InRealTime(std::move(config), options.realtime, std::move(on_cycle)),
      options_(std::move(options)) {}

void EkiServer::start() {
  if (running()) return;
  if (!client_.is_open())
    client_.open(options_.address, options_.port.value_or(machine_.channel().config().port));
  machine_.start_program();
  run();
}

void EkiServer::cycle(TimePoint now) {
  const bool cable = !unplugged_;
  if (cable) client_.take(machine_);
  machine_.tick(now);
  if (on_cycle_) on_cycle_(machine_, now);
  client_.collect(machine_);
  if (cable) client_.give(machine_);
}

/// One channel on its socket.
struct EkiStreamServer::Endpoint {
  Endpoint(EkiStream& k, std::size_t i) : krc(k), index(i), udp(channel().config().udp) {}
  ~Endpoint() {
    if (datagrams.fd >= 0) ::close(datagrams.fd);
  }

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

EkiStreamServer::EkiStreamServer(EkiStreamConfig config, EkiStreamServerOptions options,
                                 CycleHook on_cycle)
    : InRealTime(std::move(config), options.realtime, std::move(on_cycle)),
      options_(std::move(options)) {
  for (std::size_t i = 0; i < machine_.channels(); ++i)
    endpoints_.push_back(std::make_unique<Endpoint>(machine_, i));
}
EkiStreamServer::~EkiStreamServer() { stop(); }

void EkiStreamServer::start() {
  if (running()) return;
  for (const auto& endpoint : endpoints_)
    if (!endpoint->is_open()) endpoint->open(options_);
  run();
}

void EkiStreamServer::cycle(TimePoint now) {
  for (const auto& endpoint : endpoints_) endpoint->take();
  machine_.tick(now);
  if (on_cycle_) on_cycle_(machine_, now);
  for (const auto& endpoint : endpoints_) endpoint->give();
}

std::uint16_t EkiStreamServer::port(std::size_t channel) const {
  return endpoints_.at(channel)->port();
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
