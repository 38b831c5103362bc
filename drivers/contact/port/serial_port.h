#pragma once
// Opening a serial device so that nobody else can, with errors that say what to do.

#include <memory>
#include <string>

#include "drivers/error.h"
#include "drivers/io_thread.h"

namespace cellcal::drivers {

struct SerialPortOptions {
  std::string device;  ///< a path; symlinks are followed
  int baud = 1'000'000;
  /// Also a pseudo-terminal, which it then needs help with: for tests of the path of real devices.
  bool always_libserialport = false;
  /// SCHED_FIFO of the threads that carry its bytes, where permitted; 0: none.
  int priority = kPortPriority;
};

/// An open, exclusive, raw, non-blocking port; its end of file means a lost device. Closing discards
/// what was not sent.
class SerialPort {
 public:
  virtual ~SerialPort() = default;
  /// Valid while this lives; give others (Asio) a dup of it.
  virtual int fd() const = 0;
  /// The device after its symlinks.
  virtual const std::string& path() const = 0;
  /// What is not as good as it should be, and the fix; empty if all is well.
  virtual const std::string& warning() const = 0;
};

/// Pseudo-terminals through termios, USB nodes (/dev/bus/usb) through libusb, everything else
/// through libserialport.
/// Throws DriverError: no such device, no permission, in use, not a serial port.
std::unique_ptr<SerialPort> open_serial_port(const SerialPortOptions& options);

}  // namespace cellcal::drivers
