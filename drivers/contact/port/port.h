#pragma once
// Exclusive connection to the sensor: one interface for all kinds, and one function that opens
// them, with errors that state the remedy.

#include <netinet/in.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "drivers/error.h"
#include "drivers/io_thread.h"
#include "drivers/time.h"

namespace cellcal::drivers {

struct PortOptions {
  /// A path, with symlinks resolved, or "udp:ADDRESS:PORT" (IPv4) for a board on Ethernet.
  std::string device;
  int baud = 1'000'000;  ///< serial only
  /// Uses libserialport also for a pseudo-terminal, with the necessary workarounds: tests the code
  /// path of real devices.
  bool always_libserialport = false;
  /// SCHED_FIFO priority of the I/O threads, if permitted; 0: none.
  int priority = kPortPriority;
};

/// True if the connection uses datagrams, which may be lost, duplicated and reordered, and have no
/// baud rate.
bool is_datagrams(const std::string& device);

/// Result of one read().
struct PortReading {
  std::size_t size = 0;  ///< 0 without loss: no data
  bool lost = false;     ///< the port is gone; no more data
  int error = 0;         ///< if lost: errno, 0: end of file
  TimePoint arrived{};   ///< arrival of the bytes in this computer, as precisely as known
};

// Exclusive use of a serial device per process: a lock file, held by flock so that a crash releases
// it.

class PortLock {
 public:
  /// Locks the device of this path (symlinks resolved). Throws DriverError if another process, or
  /// another port of this one, holds it.
  explicit PortLock(const std::string& device);
  ~PortLock();
  PortLock(const PortLock&) = delete;
  PortLock& operator=(const PortLock&) = delete;

 private:
  int fd_ = -1;
};

/// An open, exclusive, non-blocking port. Closing discards unsent data.
class Port {
 public:
  virtual ~Port() = default;
  /// Valid during the lifetime, for polling: readable when read() has data.
  int fd() const { return fd_; }
  /// Reads pending data. Does not block beyond the kernel's own delays.
  virtual PortReading read(std::span<std::uint8_t> into);
  /// Writes a whole frame. False: not or not completely accepted.
  virtual bool write(std::span<const std::uint8_t> frame);
  /// Device path after resolving symlinks.
  const std::string& path() const { return path_; }
  /// Deficiency of the port and its remedy; empty if there is none.
  const std::string& warning() const { return warning_; }

 protected:
  /// Locks the device. Derived classes open `fd_`, and close it in their destructor, before the lock is released.
  explicit Port(const std::string& path) : path_(path), lock_(path) {}

  const std::string path_;
  std::string warning_;
  int fd_ = -1;

 private:
  PortLock lock_;
};

/// Selected by the device name: a board on Ethernet, a pseudo-terminal (termios), a USB node
/// (/dev/bus/usb, libusb), otherwise libserialport. Throws DriverError: no such device, no
/// permission, in use, not a serial port; ConfigError.
std::unique_ptr<Port> open_port(const PortOptions& options);

// Sentences for failures to open a serial device, with the remedy.

/// From errno of open(): no such device, not a serial port, permission (with the required group), busy, or the
/// system's error message.
std::string cannot_open(const std::string& device, int error);

/// Name of the lock file of a device: LCK..ttyUSB0, LCK..pts-3 (as used by minicom and others).
std::string lock_name(const std::string& device);

// Backends of serial ports; paths without symlinks. All throw DriverError.

/// Through libserialport, which provides port names, descriptions and arbitrary baud rates.
std::unique_ptr<Port> open_real_port(const std::string& path, int baud);
/// Through libusb, bypassing the terminal: a node below /dev/bus/usb of a CDC-ACM or FTDI adapter.
/// `priority`: SCHED_FIFO of the I/O thread; 0: none.
std::unique_ptr<Port> open_usb_port(const std::string& path, int baud, int priority);

// A board on Ethernet as a port: one datagram contains whole frames of CTP/1.
//
// Only the board's own address and port are received: the kernel drops all other datagrams on a
// connected socket. This does not protect against a computer that forges them, so the network must
// be dedicated to the cell. A disconnected cable, or a board without supply, appears as silence and
// not as a lost port: the protocol's dead men detect it, and the same socket receives the board
// again.

/// Parses "udp:ADDRESS:PORT". Empty: another form, or not the address of a board.
std::optional<sockaddr_in> udp_device_of(const std::string& device);

/// Throws ConfigError: not of that form. DriverError: in use, no route to that address.
std::unique_ptr<Port> open_udp_port(const std::string& device);

}  // namespace cellcal::drivers
