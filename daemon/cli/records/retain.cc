#include "daemon/cli/records/retain.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "daemon/cli/ask.h"
#include "daemon/cli/offline/exit_status.h"
#include "daemon/cli/offline/offline.h"

namespace cellcal::daemon {

int retain(const Connection& daemon, bool dry_run, std::optional<int> days,
           std::optional<double> megabytes) {
  using nlohmann::json;
  constexpr double kMegabyte = 1e6;
  json body{{"dry_run", dry_run}};
  if (days) body["days"] = *days;
  if (megabytes) body["megabytes"] = *megabytes;
  const json answer = parse(ask(daemon, "POST", "/v1/retain", body.dump()));
  if (daemon.json) {
    put(answer.dump() + "\n", {});
    return kSuccess;
  }
  std::string words;
  double bytes = 0.0;
  for (const json& one : answer.at("sessions")) {
    bytes += one.value("bytes", 0.0);
    words += fmt::format("session {:<6}  {:>8} rows  {:>8.3f} MB\n",
                         one.value("session", std::int64_t{0}), one.value("rows", std::int64_t{0}),
                         one.value("bytes", 0.0) / kMegabyte);
  }
  words += fmt::format("{} sessions, {:.1f} MB of raw events and readings {}; {:.1f} MB in use\n",
                       answer.at("sessions").size(), bytes / kMegabyte,
                       dry_run ? "would be dropped" : "dropped",
                       answer.value("bytes_in_use", 0.0) / kMegabyte);
  put(words, {});
  return kSuccess;
}

}  // namespace cellcal::daemon
