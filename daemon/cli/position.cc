#include "daemon/cli/position.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "daemon/cli/ask.h"
#include "daemon/cli/offline/exit_status.h"
#include "daemon/cli/offline/offline.h"

namespace cellcal::daemon {

int show_position(const Connection& daemon) {
  using nlohmann::json;
  const json answer = parse(ask(daemon, "POST", "/v1/position"));
  std::string text;
  for (const json& one : answer.at("axes_deg")) {
    if (!text.empty()) text += ' ';
    text += fmt::format("{:.4f}", one.get<double>());
  }
  put(daemon.json ? answer.dump() + "\n" : text + "\n", {});
  return kSuccess;
}

}  // namespace cellcal::daemon
