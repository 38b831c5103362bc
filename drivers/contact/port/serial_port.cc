#include "drivers/contact/port/serial_port.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>

#include "drivers/contact/port/port_backends.h"
#include "drivers/contact/port/port_errors.h"

namespace cellcal::drivers {

namespace {

constexpr std::string_view kPseudoTerminals = "/dev/pts/", kUsbNodes = "/dev/bus/usb/";
constexpr int kMinBaud = 9600, kMaxBaud = 4'000'000;

}  // namespace

std::unique_ptr<SerialPort> open_serial_port(const SerialPortOptions& options) {
  if (options.baud < kMinBaud || options.baud > kMaxBaud) {
    throw ConfigError(fmt::format("baud rate {} of {} is outside {} to {}", options.baud,
                                  options.device, kMinBaud, kMaxBaud));
  }
  // libserialport looks devices up by name and knows no symlinks, such as those of udev.
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
