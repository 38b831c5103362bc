#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <ctime>
#include <utility>

#include "drivers/contact/port/port.h"

namespace cellcal::drivers {

namespace {

using Steady = std::chrono::steady_clock;

constexpr std::string_view kPrefix = "udp:";
/// Maximum age of a stamp; older ones, or future ones, result from a change of the clock.
constexpr std::chrono::seconds kOldestStamp{1};
/// Expedited forwarding, for switches that support it.
constexpr int kTypeOfService = 0xB8;

std::chrono::nanoseconds to_duration(const timespec& t) {
  return std::chrono::seconds{t.tv_sec} + std::chrono::nanoseconds{t.tv_nsec};
}

/// Both clocks at one instant; `steady` is never earlier than `wall`.
struct Instant {
  std::chrono::nanoseconds wall{};
  TimePoint steady{};
};

/// A thread that is preempted between the two readings reads again.
Instant read_clocks() {
  constexpr std::chrono::microseconds kUndisturbed{20};
  constexpr int kMostReadings = 4;
  Instant best;
  auto least = Steady::duration::max();
  for (int i = 0; i < kMostReadings && least > kUndisturbed; ++i) {
    timespec wall{};
    const TimePoint before = Steady::now();
    ::clock_gettime(CLOCK_REALTIME, &wall);
    const TimePoint after = Steady::now();
    if (after - before >= least) continue;
    least = after - before;
    best = {to_duration(wall), after};
  }
  return best;
}

/// Converts the kernel's wall-clock stamp of a datagram to the steady clock.
TimePoint arrival_of(msghdr& message) {
  const Instant now = read_clocks();
  for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
    if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_TIMESTAMPNS) continue;
    timespec stamp{};
    std::memcpy(&stamp, CMSG_DATA(c), sizeof stamp);
    const auto age = now.wall - to_duration(stamp);
    if (age >= age.zero() && age <= kOldestStamp) return now.steady - age;
  }
  return now.steady;
}

class UdpPort final : public Port {
 public:
  UdpPort(const std::string& device, const sockaddr_in& to) : Port(device) {
    fd_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (fd_ < 0) throw DriverError(fmt::format("{}: socket: {}", device, std::strerror(errno)));
    const int on = 1;
    // Optional: without them the kernel's defaults apply.
    ::setsockopt(fd_, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
    ::setsockopt(fd_, IPPROTO_IP, IP_TOS, &kTypeOfService, sizeof kTypeOfService);
    if (::connect(fd_, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
      const int error = errno;
      ::close(fd_);
      throw DriverError(fmt::format(
          "{}: no way to that address: {}. Set an address of the same network on the network card "
          "that the board is plugged into",
          device, std::strerror(error)));
    }
  }
  ~UdpPort() override { ::close(fd_); }

  /// Never lost: an ICMP error for an absent board counts as silence.
  PortReading read(std::span<std::uint8_t> into) override {
    // Room for a missing delimiter of the datagram.
    iovec part{into.data(), into.size() - 1};
    alignas(cmsghdr) std::array<char, 128> control{};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    const ssize_t n = ::recvmsg(fd_, &message, 0);
    PortReading reading;
    if (n <= 0) return reading;
    reading.arrived = arrival_of(message);
    reading.size = static_cast<std::size_t>(n);
    // A truncated frame ends with its datagram and does not affect the next.
    if (into[reading.size - 1] != 0) into[reading.size++] = 0;
    return reading;
  }

  bool write(std::span<const std::uint8_t> frame) override {
    ssize_t n = ::send(fd_, frame.data(), frame.size(), MSG_NOSIGNAL);
    // An error of an earlier datagram is reported at the next one, which is then not sent.
    if (n < 0 && errno == ECONNREFUSED) n = ::send(fd_, frame.data(), frame.size(), MSG_NOSIGNAL);
    return n == static_cast<ssize_t>(frame.size());
  }
};

}  // namespace

bool is_datagrams(const std::string& device) { return device.starts_with(kPrefix); }

std::optional<sockaddr_in> udp_device_of(const std::string& device) {
  const std::size_t colon = device.rfind(':');
  if (!is_datagrams(device) || colon <= kPrefix.size()) return std::nullopt;
  const std::string host = device.substr(kPrefix.size(), colon - kPrefix.size());
  const char* end = device.data() + device.size();
  std::uint16_t port = 0;
  in_addr address{};
  const auto [stop, error] = std::from_chars(device.data() + colon + 1, end, port);
  if (error != std::errc{} || stop != end || port == 0) return std::nullopt;
  if (::inet_pton(AF_INET, host.c_str(), &address) != 1) return std::nullopt;
  const std::uint32_t value = ntohl(address.s_addr);
  if (value == INADDR_ANY || IN_MULTICAST(value) || value == INADDR_BROADCAST) return std::nullopt;
  sockaddr_in found{};
  found.sin_family = AF_INET;
  found.sin_port = htons(port);
  found.sin_addr = address;
  return found;
}

std::unique_ptr<Port> open_udp_port(const std::string& device) {
  const std::optional<sockaddr_in> board = udp_device_of(device);
  if (!board) {
    throw ConfigError(
        fmt::format("{}: not udp:ADDRESS:PORT (example: udp:169.254.67.84:4300)", device));
  }
  return std::make_unique<UdpPort>(device, *board);
}

}  // namespace cellcal::drivers
