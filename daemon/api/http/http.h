#pragma once
// HTTP/1.1 client over a Unix-domain socket, and errors of sockets.

#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "daemon/api/http/message.h"

namespace cellcal::daemon {

/// The socket cannot be used; the text gives path, reason and remedy.
struct SocketError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The socket belongs to a group that this user is not a member of.
struct SocketPermissionError : SocketError {
  using SocketError::SocketError;
};

/// Sends one request and returns its answer. `most`: time limit; 0: unlimited. Throws SocketError (no daemon,
/// no permission, no answer).
Response http_request(const std::filesystem::path& socket, const std::string& method,
                      const std::string& target, const std::string& body = "",
                      std::chrono::milliseconds most = {});

// Detection of requests initiated by a foreign page.

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
