#pragma once
// Questions to the daemon, and its errors as exceptions.

#include <nlohmann/json_fwd.hpp>
#include <stdexcept>
#include <string>

#include "daemon/api/http/http.h"
#include "daemon/cli/client.h"

namespace cellcal::daemon {

/// The daemon's own words, and all of its answer.
struct DaemonRefusal : std::runtime_error {
  DaemonRefusal(const std::string& words, Response answer)
      : std::runtime_error(words), response(std::move(answer)) {}
  Response response;
};

/// Throws SocketError, DaemonRefusal.
Response ask(const Connection& daemon, const char* method, const std::string& target,
             const std::string& body = "");
/// Throws SocketError where it is no JSON.
nlohmann::json parse(const Response& response);

/// Who is logged in, also behind sudo; printable.
std::string user_name();

}  // namespace cellcal::daemon
