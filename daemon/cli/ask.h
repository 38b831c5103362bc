#pragma once
// Requests to the daemon; its errors are thrown as exceptions.

#include <nlohmann/json_fwd.hpp>
#include <stdexcept>
#include <string>

#include "daemon/api/http/http.h"
#include "daemon/cli/client.h"

namespace cellcal::daemon {

/// Error message of the daemon, with its whole answer.
struct DaemonRefusal : std::runtime_error {
  DaemonRefusal(const std::string& words, Response answer)
      : std::runtime_error(words), response(std::move(answer)) {}
  Response response;
};

/// Throws SocketError, DaemonRefusal.
Response ask(const Connection& daemon, const char* method, const std::string& target,
             const std::string& body = "");
/// Throws SocketError where the body is not JSON.
nlohmann::json parse(const Response& response);

/// Login name, also under sudo; printable.
std::string user_name();

}  // namespace cellcal::daemon
