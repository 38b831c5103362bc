#include "sim/krc/eki_socket.h"

#include <arpa/inet.h>

#include <cstring>

#include "drivers/error.h"

namespace cellcal::sim {

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
