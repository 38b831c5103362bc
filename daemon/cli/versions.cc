#include "daemon/cli/versions.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "daemon/certificate/certificate.h"
#include "daemon/certificate/signed_files.h"
#include "daemon/cli/certificate.h"
#include "daemon/cli/client.h"
#include "daemon/cli/offline.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

std::string mm(const json& value) {
  return value.is_number() ? fmt::format("{:.3f}", value.get<double>()) : "-";
}

std::string version_line(const json& one) {
  constexpr std::size_t kSeconds = 19;  // YYYY-MM-DDTHH:MM:SS
  std::string line =
      fmt::format("{:>8}  {:<19}  {:<12}  {:>12}  {:>7}  {}", one["session"].get<std::int64_t>(),
                  one["ended"].get<std::string>().substr(0, kSeconds),
                  one["scope"].is_string() ? one["scope"].get<std::string>() : "damaged",
                  mm(one["predicted_mm"]), mm(one["u95_mm"]), one["active"] ? "in use" : "");
  const json& by = one["activated"];
  if (by.is_object())
    line += fmt::format("{}activated {} by {}: {}", one["active"] ? ", " : "",
                        by["time"].get<std::string>().substr(0, kSeconds),
                        by["who"].get<std::string>(), by["reason"].get<std::string>());
  while (line.ends_with(' ')) line.pop_back();
  line = printable(line) + "\n";
  if (one["trouble"].is_string())
    line += "          " + printable(one["trouble"].get<std::string>()) + "\n";
  return line;
}

/// Another model level has dozens of parameters of its own.
constexpr std::size_t kNamed = 8;

std::string in_words(const json& all) {
  if (!all["comparable"])
    return fmt::format("sessions {} and {} cannot be compared: different nominal arm or tool\n",
                       all["before"].dump(), all["after"].dump());
  std::string words = fmt::format(
      "{} mm mean, {} mm largest distance of the tips over {} poses ({}), a motion of the base taken out\n"
      "{} mm: mean distance by the predicted errors of both\n",
      mm(all["mean_mm"]), mm(all["max_mm"]), all["poses"].dump(), all["scope"].get<std::string>(),
      mm(all["expected_mm"]));
  for (const auto& [key, session] :
       {std::pair{"only_before", "before"}, std::pair{"only_after", "after"}}) {
    if (all[key].empty()) continue;
    auto names = all[key].get<std::vector<std::string>>();
    const std::size_t more = names.size() - std::min(names.size(), kNamed);
    names.resize(names.size() - more);
    words += printable(fmt::format("only session {} has: {}", all[session].dump(),
                                   fmt::join(names, ", "))) +
             (more > 0 ? fmt::format(" and {} more\n", more) : "\n");
  }
  if (all["moved"].empty()) return words + "no parameter moved beyond U (k=2)\n";
  words += fmt::format("\n{:<16}  {:>14}  {:>14}  {:>12}  {:>12}  {}\n", "moved", "before", "after",
                       "difference", "U (k=2)", "unit");
  for (const json& one : all["moved"])
    words += fmt::format("{:<16}  {:>14.6g}  {:>14.6g}  {:>+12.3g}  {:>12.3g}  {}\n",
                         printable(one["name"].get<std::string>()), one["before"].get<double>(),
                         one["after"].get<double>(), one["difference"].get<double>(),
                         one["expanded"].get<double>(), printable(one["unit"].get<std::string>()));
  return words;
}

}  // namespace

int list_versions(const Connection& daemon, std::optional<std::int64_t> of_cell) {
  const json list = parse(
      ask(daemon, "GET", "/v1/versions" + (of_cell ? fmt::format("?session={}", *of_cell) : "")));
  if (daemon.json) {
    put(list.dump() + "\n", {});
    return kSuccess;
  }
  std::string words = fmt::format("{:>8}  {:<19}  {:<12}  {:>12}  {:>7}\n", "session",
                                  "published (UTC)", "scope", "predicted mm", "u95 mm");
  for (const json& one : list) words += version_line(one);
  put(list.empty() ? "no calibration was published\n" : words, {});
  return kSuccess;
}

int activate_version(const Connection& daemon, std::optional<std::int64_t> session,
                     const std::string& reason) {
  json body{{"reason", reason}, {"by", user_name()}};
  if (session) body["session"] = *session;
  const json done = parse(ask(
      daemon, "POST", session ? "/v1/versions/activate" : "/v1/versions/roll-back", body.dump()));
  put(daemon.json
          ? done.dump() + "\n"
          : fmt::format(
                "in use: the calibration of session {}. What was made with another one (programs, frames) "
                "stays as it is\n",
                done["session"].dump()),
      {});
  return kSuccess;
}

int compare_versions(const Connection& daemon, std::int64_t before, std::int64_t after) {
  const json all = parse(
      ask(daemon, "GET", fmt::format("/v1/versions/compare?before={}&after={}", before, after)));
  put(daemon.json ? all.dump() + "\n" : in_words(all), {});
  return kSuccess;
}

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

namespace {

using nlohmann::json;
using signing::NotVerified;

/// True where verification is impossible, as opposed to failed.
bool is_open(NotVerified::Why why) {
  return why == NotVerified::Why::kNoSignature || why == NotVerified::Why::kMissingFile;
}

std::string or_not_stated(const std::string& text) { return text.empty() ? "not stated" : text; }

}  // namespace

int verify(const VerifyCommand& command) try {
  const signing::PublicKey key(command.key.empty() ? signing::public_part(default_key())
                                                   : command.key);
  const signing::Verified verified = signing::verify_files(command.file, key);
  const signing::Statement& is = verified.statement;
  const bool emulated = is.certificate.starts_with(certificate::kEmulatedNumber);
  put(command.json
          ? json{{"verified", true},
                 {"failure", nullptr},
                 {"certificate", is.certificate},
                 {"emulated", emulated},
                 {"signed_by", is.by},
                 {"signed_at", is.utc},
                 {"key", is.key},
                 {"files", verified.files}}
                    .dump() +
                "\n"
          : fmt::format(
                "verified: {}{}\n{}signed by: {}\nsigned at: {}\nkey: {}\nfiles: {}\n",
                verified.kind == signing::Kind::kExport ? "" : "certificate ", is.certificate,
                emulated
                    ? "emulated cell: a simulation, no real robot was touched. It certifies no "
                      "robot\n"
                    : "",
                or_not_stated(is.by), is.utc, is.key, fmt::join(verified.files, ", ")),
      {});
  return kSuccess;
} catch (const NotVerified& error) {
  if (command.json)
    put(json{{"verified", false},
             {"failure", signing::to_string(error.why)},
             {"words", error.what()}}
                .dump() +
            "\n",
        {});
  std::fprintf(stderr, "cellcal verify: %s\n", error.what());
  return is_open(error.why) ? kJobFailed : kNotPublishable;
}

}  // namespace cellcal::daemon
