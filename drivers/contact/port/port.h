#pragma once
// A line to the sensor that nobody else has: one interface for every kind, and one place that opens
// them, with errors that say what to do.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "drivers/error.h"
#include "drivers/io_thread.h"
#include "drivers/time.h"

namespace cellcal::drivers {

struct PortOptions {
  /// A path, whose symlinks are followed, or "udp:ADDRESS:PORT" (IPv4) for a board on Ethernet.
  std::string device;
  int baud = 1'000'000;  ///< serial alone
  /// Also a pseudo-terminal, which it then needs help with: for tests of the path of real devices.
  bool always_libserialport = false;
  /// SCHED_FIFO of the threads that carry its bytes, where permitted; 0: none.
  int priority = kPortPriority;
};

/// The line carries datagrams: they may be lost, doubled and overtaken, and know no baud rate.
bool is_datagrams(const std::string& device);

/// What one read() has brought.
struct PortReading {
  std::size_t size = 0;  ///< 0 without loss: nothing there, or nothing that counts
  bool lost = false;     ///< the port is gone; nothing comes any more
  int error = 0;         ///< lost: errno, 0: end of file
  TimePoint arrived{};   ///< when the bytes came into this computer, as well as it is known
};

/// An open, exclusive, non-blocking port. Closing discards what was not sent.
class Port {
 public:
  virtual ~Port() = default;
  /// Valid while this lives; to be waited for: readable when read() has something.
  virtual int fd() const = 0;
  /// What waits. Does not block for longer than the kernel makes it.
  virtual PortReading read(std::span<std::uint8_t> into);
  /// A whole frame. False: the port did not take it, or not all of it.
  virtual bool write(std::span<const std::uint8_t> frame);
  /// The device after its symlinks.
  virtual const std::string& path() const = 0;
  /// What is not as good as it should be, and the fix; empty if all is well.
  virtual const std::string& warning() const = 0;
};

/// By the device's name: a board on Ethernet, a pseudo-terminal (termios), a USB node (/dev/bus/usb,
/// libusb), or else libserialport.
/// Throws DriverError: no such device, no permission, in use, not a serial port; ConfigError.
std::unique_ptr<Port> open_port(const PortOptions& options);

}  // namespace cellcal::drivers
