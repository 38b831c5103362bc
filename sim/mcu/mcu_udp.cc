#include "sim/mcu/mcu_udp.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>

namespace cellcal::sim {

namespace {

constexpr int kWireRate = 100'000'000;

sockaddr* as_sockaddr(sockaddr_in& address) { return reinterpret_cast<sockaddr*>(&address); }

}  // namespace

McuOptions on_ethernet(McuOptions options) {
  options.baud = kWireRate;
  options.datagrams = true;
  options.circuit = kEthernetBoard;
  options.firmware = {1, 2, 0};
  return options;
}

McuUdp::McuUdp(const McuUdpOptions& options)
    : McuThread(on_ethernet(options.mcu), options.realtime) {
  socket_.reset(::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (socket_.get() < 0) fail("socket");
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_port = htons(options.port);
  errno = EINVAL;
  if (::inet_pton(AF_INET, options.address.c_str(), &own.sin_addr) != 1) fail("address");
  socklen_t size = sizeof own;
  if (::bind(socket_.get(), as_sockaddr(own), size) != 0) fail("bind");
  if (::getsockname(socket_.get(), as_sockaddr(own), &size) != 0) fail("getsockname");
  path_ = "udp:" + options.address + ":" + std::to_string(ntohs(own.sin_port));
  start();
}

void McuUdp::read_host() {
  std::array<std::uint8_t, 512> bytes{};
  while (true) {
    sockaddr_in from{};
    socklen_t size = sizeof from;
    const ssize_t n =
        ::recvfrom(socket_.get(), bytes.data(), bytes.size(), 0, as_sockaddr(from), &size);
    if (n < 0 && errno == ECONNREFUSED) continue;  // from an earlier send to a closed socket
    if (n < 0) break;
    act([&](Microcontroller& mcu) {
      mcu.receive({bytes.data(), static_cast<std::size_t>(n)}, std::chrono::steady_clock::now(),
                  {from.sin_addr.s_addr, from.sin_port});
    });
  }
}

bool McuUdp::write_host(const Microcontroller::Output& output) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = output.to.port;
  to.sin_addr.s_addr = output.to.address;
  const auto bytes = output.frame.bytes();
  return ::sendto(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL, as_sockaddr(to),
                  sizeof to) == static_cast<ssize_t>(bytes.size());
}

}  // namespace cellcal::sim
