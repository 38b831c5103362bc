#pragma once
// HTTP/1.1 client over a Unix-domain socket, and errors of sockets.

#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <string>

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

}  // namespace cellcal::daemon
