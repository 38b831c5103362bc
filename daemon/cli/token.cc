#include "daemon/cli/token.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "daemon/cli/ask.h"
#include "daemon/cli/offline.h"

namespace cellcal::daemon {

using nlohmann::json;

int add_token(const Connection& daemon, const std::string& name, const std::string& role) {
  const json body{{"name", name}, {"role", role}};
  const json made = parse(ask(daemon, "POST", "/v1/tokens", body.dump()));
  put(daemon.json ? made.dump() + "\n" : made.value("token", "") + "\n", {});
  if (!daemon.json) {
    std::fprintf(stderr,
                 "token \"%s\", role %s: copy it now, it is not shown again. Revoke: 'cellcal "
                 "token remove %s'\n",
                 name.c_str(), role.c_str(), name.c_str());
  }
  return kSuccess;
}

int list_tokens(const Connection& daemon) {
  const json list = parse(ask(daemon, "GET", "/v1/tokens"));
  if (daemon.json) {
    put(list.dump() + "\n", {});
    return kSuccess;
  }
  std::string words = fmt::format("{:<24}  {:<10}  {}\n", "name", "role", "created");
  for (const json& one : list) {
    words += fmt::format("{:<24}  {:<10}  {}\n", one.value("name", ""), one.value("role", ""),
                         one.value("created", ""));
  }
  put(list.empty() ? "no tokens: no access over the network\n" : words, {});
  return kSuccess;
}

int remove_token(const Connection& daemon, const std::string& name) {
  ask(daemon, "DELETE", "/v1/tokens/" + name);
  if (!daemon.json) put("token \"" + name + "\" is no longer accepted\n", {});
  return kSuccess;
}

}  // namespace cellcal::daemon
