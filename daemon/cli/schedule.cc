#include "daemon/cli/schedule.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "daemon/cli/ask.h"
#include "daemon/cli/offline.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

constexpr std::size_t kShown = 10;

std::string entry_words(const json& entry) {
  const json& now = entry.at("now");
  const json& next = entry.at("next");
  std::string when = next.is_null()
                         ? "no next window"
                         : "next " + next.value("begins", "") + " to " + next.value("ends", "");
  if (!now.is_null()) when = "now, until " + now.value("ends", "") + "; " + when;
  std::string text = fmt::format("{:<16}  {:<10}  {}{}, {:.0f} min expected\n",
                                 entry.value("name", ""), entry.value("kind", ""), when,
                                 entry.value("on_request", false) ? ", on request" : "",
                                 entry.value("foreseen_s", 0.0) / 60.0);
  const json& last = entry.at("last");
  if (!last.is_null())
    text +=
        fmt::format("{:<16}  last: {}  {}\n", "", last.value("at", ""), last.value("words", ""));
  return text;
}

std::string schedule_words(const json& schedule) {
  std::string text;
  if (!schedule.value("unattended", false)) {
    text += "unattended = false: nothing begins without a person ([schedule] in cellcald.toml)\n";
  } else {
    text += "without a person; responsible: " + schedule.value("responsible", "") + "\n";
  }
  if (!schedule.at("held").is_null()) text += schedule.value("held", "") + "\n";
  if (schedule.at("entries").empty()) text += "no [[schedule.session]] in cellcald.toml\n";
  for (const json& entry : schedule.at("entries")) text += entry_words(entry);
  const json& decisions = schedule.at("decisions");
  if (!decisions.empty()) text += "decisions, newest first\n";
  for (std::size_t i = 0; i < decisions.size() && i < kShown; ++i) {
    text += fmt::format("{}  {:<16}  {}\n", decisions[i].value("at", ""),
                        decisions[i].value("entry", ""), decisions[i].value("words", ""));
  }
  return text;
}

}  // namespace

int show_schedule(const Connection& daemon) {
  const json schedule = parse(ask(daemon, "GET", "/v1/schedule"));
  put(daemon.json ? schedule.dump() + "\n" : schedule_words(schedule), {});
  return kSuccess;
}

int begin_scheduled(const Connection& daemon, const std::string& name) {
  const json made = parse(ask(daemon, "POST", "/v1/schedule/begin", json{{"name", name}}.dump()));
  put(daemon.json ? made.dump() + "\n"
                  : fmt::format("session {} begun\n", made.value("session", std::int64_t{0})),
      {});
  return kSuccess;
}

int release_schedule(const Connection& daemon) {
  const json answer = parse(ask(daemon, "POST", "/v1/schedule/release"));
  put(daemon.json ? answer.dump() + "\n" : "released: scheduled sessions begin again\n", {});
  return kSuccess;
}

}  // namespace cellcal::daemon
