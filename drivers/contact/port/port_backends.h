#pragma once
// Backends of serial ports; paths without symlinks. All throw DriverError.

#include <memory>
#include <string>

#include "drivers/contact/port/port.h"

namespace cellcal::drivers {

/// Through libserialport, which provides port names, descriptions and arbitrary baud rates.
std::unique_ptr<Port> open_real_port(const std::string& path, int baud);
/// libserialport 0.1.1 cannot open pseudo-terminals (they are not in /sys and refuse TIOCMGET).
std::unique_ptr<Port> open_pseudo_terminal(const std::string& path, int baud);

/// Through libusb, bypassing the terminal: a node below /dev/bus/usb of a CDC-ACM or FTDI adapter.
/// `priority`: SCHED_FIFO of the I/O thread; 0: none.
std::unique_ptr<Port> open_usb_port(const std::string& path, int baud, int priority);

/// Terminal settings of an open descriptor: exclusive, close-on-exec, non-blocking, raw, with a read()
/// that waits for a byte instead of reporting the end of the file. Throws DriverError.
void make_exclusive_and_raw(int fd, const std::string& path);
/// Discards unsent data and releases exclusive access; to be called just before close().
void let_go(int fd);

}  // namespace cellcal::drivers
