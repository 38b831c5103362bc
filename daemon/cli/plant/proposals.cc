#include "daemon/cli/plant/proposals.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "daemon/cli/ask.h"
#include "daemon/cli/offline/exit_status.h"
#include "daemon/cli/offline/offline.h"
#include "daemon/cli/user_name.h"
#include "daemon/files/printable.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

constexpr std::size_t kSeconds = 19;  // YYYY-MM-DDTHH:MM:SS

std::string text_in(const json& one, const char* key) {
  return one[key].is_string() ? printable(one[key].get<std::string>()) : "";
}

/// What the plant asks for.
std::string wish(const json& one) {
  const std::string kind = text_in(one, "kind");
  if (kind == "calibrate") return "calibrate this cell";
  if (kind == "check") return "check this cell";
  if (kind == "activate")
    return "use the calibration of session " + one["session"].dump() + " again";
  if (kind == "withdraw") return "nothing: withdrawn before it came";
  return kind == "schedule" ? "another schedule" : "other tolerances of the robot (priors)";
}

/// What is to be done once it is accepted.
std::string what_to_do_with(const json& one) {
  const std::string kind = text_in(one, "kind");
  if (kind == "calibrate") return "Now: 'cellcal run --cell CELL'";
  if (kind == "check") return "Now: 'cellcal check'";
  if (kind == "activate") return "It is in use. Corrected programs and frames stay unchanged";
  if (kind == "priors") return "Now: 'cellcal priors accept " + text_in(one, "file") + "'";
  return "Now: put " + text_in(one, "file") +
         " under [schedule] of cellcald.toml, then 'systemctl reload cellcald'";
}

std::string proposal_line(const json& one) {
  std::string line =
      fmt::format("{:<20}  {:<19}  {:<8}  {}, by {}: {}", text_in(one, "id"),
                  text_in(one, "received").substr(0, kSeconds), text_in(one, "stand"), wish(one),
                  text_in(one, "by"), text_in(one, "reason"));
  if (const std::string by = text_in(one, "decided_by"); !by.empty()) {
    line += fmt::format(" ({} by {}", text_in(one, "stand"), by);
    if (const std::string why = text_in(one, "decided_reason"); !why.empty()) line += ": " + why;
    line += ")";
  }
  return line + "\n";
}

std::string path_of(const std::string& id, const char* verb) {
  return "/v1/proposals/" + id + "/" + verb;
}

json body_with(const std::string& reason) {
  json body{{"by", user_name()}};
  if (!reason.empty()) body["reason"] = reason;
  return body;
}

}  // namespace

int list_proposals(const Connection& daemon) {
  const json all = parse(ask(daemon, "GET", "/v1/proposals"));
  if (daemon.json) {
    put(all.dump() + "\n", {});
    return kSuccess;
  }
  if (const std::string problem = text_in(all, "problem"); !problem.empty())
    throw std::runtime_error(problem);
  std::string words =
      fmt::format("{:<20}  {:<19}  {:<8}  {}\n", "id", "received (UTC)", "stand", "proposal");
  for (const json& one : all["proposals"]) words += proposal_line(one);
  if (const auto dropped = all.value("dropped", std::int64_t{0}); dropped > 0)
    words += fmt::format("{} older decided proposals are no longer listed\n", dropped);
  put(all["proposals"].empty() ? "the plant proposed nothing\n" : words, {});
  return kSuccess;
}

int accept_proposal(const Connection& daemon, const std::string& id, const std::string& reason) {
  const json done = parse(ask(daemon, "POST", path_of(id, "accept"), body_with(reason).dump()));
  put(daemon.json ? done.dump() + "\n"
                  : "accepted: " + wish(done) + ". " + what_to_do_with(done) + "\n",
      {});
  return kSuccess;
}

int refuse_proposal(const Connection& daemon, const std::string& id, const std::string& reason) {
  const json done = parse(ask(daemon, "POST", path_of(id, "refuse"), body_with(reason).dump()));
  put(daemon.json ? done.dump() + "\n" : "refused: " + wish(done) + "\n", {});
  return kSuccess;
}

}  // namespace cellcal::daemon
