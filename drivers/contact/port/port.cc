#include "drivers/contact/port/port.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <filesystem>

#include "drivers/contact/port/port_backends.h"
#include "drivers/contact/port/port_errors.h"
#include "drivers/contact/port/udp_port.h"

namespace cellcal::drivers {

namespace {

constexpr std::string_view kPseudoTerminals = "/dev/pts/", kUsbNodes = "/dev/bus/usb/";
constexpr int kMinBaud = 9600, kMaxBaud = 4'000'000;

}  // namespace

PortReading Port::read(std::span<std::uint8_t> into) {
  const ssize_t n = ::read(fd(), into.data(), into.size());
  PortReading reading;
  const int error = n < 0 ? errno : 0;
  reading.arrived = std::chrono::steady_clock::now();
  if (n > 0) {
    reading.size = static_cast<std::size_t>(n);
  } else if (error != EINTR && error != EAGAIN) {
    reading.lost = true;
    reading.error = error;
  }
  return reading;
}

bool Port::write(std::span<const std::uint8_t> frame) {
  ssize_t n = -1;
  do {
    n = ::write(fd(), frame.data(), frame.size());
  } while (n < 0 && errno == EINTR);
  return n == static_cast<ssize_t>(frame.size());
}

std::unique_ptr<Port> open_port(const PortOptions& options) {
  if (is_datagrams(options.device)) return open_udp_port(options.device);
  if (options.baud < kMinBaud || options.baud > kMaxBaud) {
    throw ConfigError(fmt::format("baud rate {} of {} is outside {} to {}", options.baud,
                                  options.device, kMinBaud, kMaxBaud));
  }
  // libserialport looks up devices by name and does not resolve symlinks, such as those of udev.
  std::error_code error;
  const std::filesystem::path real = std::filesystem::canonical(options.device, error);
  if (error) throw DriverError(cannot_open(options.device, error.value()));
  const std::string path = real.string();
  if (!std::filesystem::is_character_file(real)) throw DriverError(cannot_open(path, ENOTTY));
  if (path.rfind(kPseudoTerminals, 0) == 0 && !options.always_libserialport) {
    return open_pseudo_terminal(path, options.baud);
  }
  if (path.rfind(kUsbNodes, 0) == 0) return open_usb_port(path, options.baud, options.priority);
  return open_real_port(path, options.baud);
}

}  // namespace cellcal::drivers
