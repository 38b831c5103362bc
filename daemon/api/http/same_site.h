#pragma once
// Detection of requests initiated by a foreign page.

#include <string>
#include <vector>

#include "daemon/api/http/message.h"

namespace cellcal::daemon {

/// True if the Host header names this computer: an address, "localhost" or one of `names` (lower case). This
/// detects DNS rebinding, in which a foreign name resolves to this computer's address; a literal address
/// cannot be rebound.
bool host_is_ours(const Request& request, const std::vector<std::string>& names);

/// True without an Origin header (browsers send it with every POST), or with the origin of this host and
/// port. With `tls` only https is accepted, since a page sent in clear text can be forged; without, a proxy
/// in front of the daemon may terminate TLS.
bool origin_is_ours(const Request& request, bool tls);

/// Network that one host may use entirely: the /64 of an IPv6 address (with its interface, if any), otherwise
/// the address itself. A key for counting, not for display.
std::string network_of(const std::string& address);

}  // namespace cellcal::daemon
