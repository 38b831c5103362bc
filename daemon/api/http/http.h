#pragma once
// HTTP/1.1 over a Unix-domain socket: the client, and what can be wrong with a socket.

#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "daemon/api/http/message.h"

namespace cellcal::daemon {

/// The socket cannot be used: says which, why, and what to do.
struct SocketError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// It belongs to a group that this user is not in.
struct SocketPermissionError : SocketError {
  using SocketError::SocketError;
};

/// One request, one answer. `most`: how long it may take; 0: as long as it takes. Throws SocketError (no daemon, no permission, no
/// answer).
Response http_request(const std::filesystem::path& socket, const std::string& method,
                      const std::string& target, const std::string& body = "",
                      std::chrono::milliseconds most = {});

}  // namespace cellcal::daemon
