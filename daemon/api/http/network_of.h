#pragma once

#include <string>

namespace cellcal::daemon {

/// What one host may have many addresses of: of IPv6 its /64 (with the interface, where the address names
/// one), else the address itself. To count by; not for people to read.
std::string network_of(const std::string& address);

}  // namespace cellcal::daemon
