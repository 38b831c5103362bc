#pragma once
// A board on Ethernet as a port: one datagram holds whole frames of CTP/1.
//
// Only the board's own address and port are heard: the kernel drops all else on a connected socket.
// It is no protection against a computer that forges them, so the wire belongs to the cell alone. A
// cable that is pulled, or a board without supply, is silence and no lost port: the protocol's dead
// men notice it, and the same socket hears the board again.

#include <netinet/in.h>

#include <memory>
#include <optional>
#include <string>

#include "drivers/contact/port/port.h"

namespace cellcal::drivers {

/// "udp:ADDRESS:PORT" taken apart. Nothing: it is not of that form, or no address of a board.
std::optional<sockaddr_in> udp_device_of(const std::string& device);

/// Throws ConfigError: not of that form. DriverError: in use, no way to that address.
std::unique_ptr<Port> open_udp_port(const std::string& device);

}  // namespace cellcal::drivers
