#pragma once
// Questions to the daemon, and its errors as exceptions.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "daemon/api/http/http.h"
#include "daemon/cli/client.h"

namespace cellcal::daemon {

/// Throws SocketError; std::runtime_error with the daemon's own words.
Response ask(const Connection& daemon, const char* method, const std::string& target,
             const std::string& body = "");
/// Throws SocketError where it is no JSON.
nlohmann::json parse(const Response& response);

}  // namespace cellcal::daemon
