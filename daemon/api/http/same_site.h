#pragma once
// Whether a browser was led here by a page that is not ours.

#include <string>
#include <vector>

#include "daemon/api/http/message.h"

namespace cellcal::daemon {

/// The Host header is one of this computer's: an address, "localhost" or one of the names (in lower
/// case). A page that has its own name resolved to this computer's address (DNS rebinding) is found by
/// it; nobody can do that with an address.
bool host_is_ours(const Request& request, const std::vector<std::string>& names);

/// Without an Origin header, which browsers send with every POST, or with that of the page that was
/// got from the same host and port; `tls`: over TLS alone, since anybody
/// on the way can send a page without it. (Without, a proxy before this daemon may speak it.)
bool origin_is_ours(const Request& request, bool tls);

/// What one host may have many addresses of: of IPv6 its /64 (with the interface, where the address names
/// one), else the address itself. To count by; not for people to read.
std::string network_of(const std::string& address);

}  // namespace cellcal::daemon
