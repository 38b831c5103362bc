#pragma once
// A board on Ethernet as a port: one datagram contains whole frames of CTP/1.
//
// Only the board's own address and port are received: the kernel drops all other datagrams on a
// connected socket. This does not protect against a computer that forges them, so the network must
// be dedicated to the cell. A disconnected cable, or a board without supply, appears as silence and
// not as a lost port: the protocol's dead men detect it, and the same socket receives the board
// again.

#include <netinet/in.h>

#include <memory>
#include <optional>
#include <string>

#include "drivers/contact/port/port.h"

namespace cellcal::drivers {

/// Parses "udp:ADDRESS:PORT". Empty: another form, or not the address of a board.
std::optional<sockaddr_in> udp_device_of(const std::string& device);

/// Throws ConfigError: not of that form. DriverError: in use, no route to that address.
std::unique_ptr<Port> open_udp_port(const std::string& device);

}  // namespace cellcal::drivers
