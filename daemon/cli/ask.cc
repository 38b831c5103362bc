#include "daemon/cli/ask.h"

#include <fmt/format.h>
#include <pwd.h>
#include <unistd.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "daemon/files/system_words.h"

namespace cellcal::daemon {

using nlohmann::json;

json parse(const Response& response) {
  json value = json::parse(response.body, nullptr, false);
  if (value.is_discarded())
    throw SocketError(
        "the daemon's answer is not JSON. Check that cellcal and cellcald are of the same version");
  return value;
}

Response ask(const Connection& daemon, const char* method, const std::string& target,
             const std::string& body) {
  Response response = http_request(daemon.socket, method, target, body);
  if (response.status < 300) return response;
  const json value = json::parse(response.body, nullptr, false);
  const bool words = value.is_object() && value.contains("error") && value["error"].is_string();
  throw DaemonRefusal(words ? value["error"].get<std::string>()
                            : fmt::format("the daemon answered {}", response.status),
                      std::move(response));
}

std::string user_name() {
  const char* before_sudo = std::getenv("SUDO_USER");
  if (before_sudo != nullptr && *before_sudo != '\0') return printable(before_sudo);
  const passwd* entry = ::getpwuid(::getuid());
  return entry != nullptr ? printable(entry->pw_name) : std::to_string(::getuid());
}

}  // namespace cellcal::daemon
