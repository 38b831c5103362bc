#pragma once
// The ways to open a serial port; paths without symlinks. All throw DriverError.

#include <memory>
#include <string>

#include "drivers/contact/port/port.h"

namespace cellcal::drivers {

/// Through libserialport, which brings port names, descriptions and any baud rate.
std::unique_ptr<Port> open_real_port(const std::string& path, int baud);
/// libserialport 0.1.1 cannot open pseudo-terminals (they are not in /sys and refuse TIOCMGET).
std::unique_ptr<Port> open_pseudo_terminal(const std::string& path, int baud);

/// Through libusb, past the terminal: a node below /dev/bus/usb of a CDC-ACM or FTDI adapter.
/// `priority`: SCHED_FIFO of the thread that carries the bytes; 0: none.
std::unique_ptr<Port> open_usb_port(const std::string& path, int baud, int priority);

/// What terminals need of an open descriptor: nobody else, no inheritance, no blocking, raw, and read()
/// that waits for a byte instead of calling an empty line the end of the file. Throws DriverError.
void make_exclusive_and_raw(int fd, const std::string& path);
/// Discards what is unsent and lets others in again; for just before close().
void let_go(int fd);

}  // namespace cellcal::drivers
