#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/certificate/certificate.h"
#include "daemon/certificate/signed_files.h"
#include "daemon/cli/actions.h"
#include "daemon/cli/client.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/offline.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

// Published calibrations as versions; deletion of raw events and readings of old sessions.

using nlohmann::json;

std::string mm(const json& value) {
  return value.is_number() ? say({"say.cli.versions.mm", {{"mm", value.get<double>()}}}) : "-";
}

std::string scope(const json& value) {
  return say("say.cli.versions." + (value.is_string() ? value.get<std::string>() : "damaged"));
}

std::string version_line(const json& one) {
  constexpr std::size_t kSeconds = 19;  // YYYY-MM-DDTHH:MM:SS
  std::string line =
      fmt::format("{:>8}  {:<19}  {:<12}  {:>12}  {:>7}  {}", one["session"].get<std::int64_t>(),
                  one["ended"].get<std::string>().substr(0, kSeconds), scope(one["scope"]),
                  mm(one["predicted_mm"]), mm(one["u95_mm"]),
                  one["active"] ? say("say.cli.versions.in_use") : "");
  const json& by = one["activated"];
  if (by.is_object())
    line += (one["active"] ? ", " : "") +
            say({"say.cli.versions.activated",
                 {{"time", by["time"].get<std::string>().substr(0, kSeconds)},
                  {"who", by["who"].get<std::string>()},
                  {"reason", by["reason"].get<std::string>()}}});
  while (line.ends_with(' ')) line.pop_back();
  line = printable(line) + "\n";
  if (one["trouble"].is_string())
    line += "          " + printable(one["trouble"].get<std::string>()) + "\n";
  return line;
}

/// Another model level has dozens of parameters of its own.
constexpr std::size_t kNamed = 8;
constexpr std::size_t kMostVersions = 100;

std::string names_in(const json& list, std::size_t most) {
  auto names = list.get<std::vector<std::string>>();
  names.resize(std::min(names.size(), most));
  return printable(fmt::format("{}", fmt::join(names, ", ")));
}

/// For the cell of that session; without one, of the calibration in use.
int list_versions(const Connection& daemon, std::optional<std::int64_t> of_cell) {
  const json list = parse(ask(daemon, "GET",
                              fmt::format("/v1/versions?limit={}", kMostVersions) +
                                  (of_cell ? fmt::format("&session={}", *of_cell) : "")));
  return print_result(daemon.json, list, versions_text(list));
}

/// Without a session: the calibration published before the one in use.
int activate_version(const Connection& daemon, std::optional<std::int64_t> session,
                     const std::string& reason) {
  json body{{"reason", reason}, {"by", user_name()}};
  if (session) body["session"] = *session;
  const json done = parse(ask(
      daemon, "POST", session ? "/v1/versions/activate" : "/v1/versions/roll-back", body.dump()));
  return print_result(
      daemon.json, done,
      said({"say.cli.activated", {{"session", done.at("session").get<std::int64_t>()}}}));
}

int compare_versions(const Connection& daemon, std::int64_t before, std::int64_t after) {
  const json all = parse(
      ask(daemon, "GET", fmt::format("/v1/versions/compare?before={}&after={}", before, after)));
  return print_result(daemon.json, all, comparison_text(all));
}

int retain(const Connection& daemon, bool dry_run, std::optional<int> days,
           std::optional<double> megabytes) {
  using nlohmann::json;
  constexpr double kMegabyte = 1e6;
  json body{{"dry_run", dry_run}};
  if (days) body["days"] = *days;
  if (megabytes) body["megabytes"] = *megabytes;
  const json answer = parse(ask(daemon, "POST", "/v1/retain", body.dump()));
  std::string words;
  double bytes = 0.0;
  for (const json& one : answer.at("sessions")) {
    const double its_bytes = one.value("bytes", 0.0);
    bytes += its_bytes;
    words += said({"say.cli.retain.session",
                   {{"session", one.value("session", std::int64_t{0})},
                    {"rows", one.value("rows", std::int64_t{0})},
                    {"mb", its_bytes / kMegabyte}}});
  }
  words += said({dry_run ? "say.cli.retain.would" : "say.cli.retain.dropped",
                 {{"n", answer.at("sessions").size()},
                  {"mb", bytes / kMegabyte},
                  {"used", answer.value("bytes_in_use", 0.0) / kMegabyte}}});
  return print_result(daemon.json, answer, words);
}

using signing::NotVerified;

/// True where verification is impossible, as opposed to failed.
bool is_open(NotVerified::Why why) {
  return why == NotVerified::Why::kNoSignature || why == NotVerified::Why::kMissingFile;
}

std::string or_not_stated(const std::string& text) { return text.empty() ? "not stated" : text; }

void add_export(CLI::App& app, int& status) {
  const auto [command, given, connection] =
      add_request<ExportCommand>(app, status, "export", export_session);
  command->add_option("ID", given->session)->required()->check(session_number());
  command->add_option("DIR", given->directory)->required();
  command->add_option("--key", given->key);
  command->add_flag_callback("--no-sign", [given] { given->sign = false; });
}

void add_import(CLI::App& app, int& status) {
  struct Given {
    std::filesystem::path directory, key;
  };
  const auto [command, given, connection] =
      add_request<Given>(app, status, "import", [](const Connection& daemon, const Given& of) {
        return import_session(daemon, of.directory, of.key);
      });
  command->add_option("DIR", given->directory)->required();
  command->add_option("--key", given->key);
}

void add_replay(CLI::App& app, int& status) {
  const auto [command, given, connection] =
      add_request<std::string>(app, status, "replay", replay_session);
  command->add_option("SESSION", *given)->required();
}

void add_backup(CLI::App& app, int& status) {
  const auto [command, given, connection] =
      add_request<std::filesystem::path>(app, status, "backup", back_up);
  command->add_option("FILE", *given)->required();
}

void add_retain(CLI::App& app, int& status) {
  struct Given {
    bool dry_run = false;
    std::optional<int> days;
    std::optional<double> megabytes;
  };
  const auto [command, given, connection] =
      add_request<Given>(app, status, "retain", [](const Connection& daemon, const Given& of) {
        return retain(daemon, of.dry_run, of.days, of.megabytes);
      });
  command->add_flag("--dry-run", given->dry_run);
  command->add_option("--days", given->days)->check(between(1, 36500));
  command->add_option("--megabytes", given->megabytes)->check(between(1.0, 1e9));
}

void add_certificate(CLI::App& app, int& status) {
  struct Given : CertificateCommand {
    bool make_key = false;
  };
  const auto [command, given, connection] = add_request<Given>(
      app, status, "certificate", [](const Connection& daemon, const Given& wanted) {
        if (wanted.make_key)
          return make_certificate_key(wanted.key.empty() ? default_key() : wanted.key, daemon.json);
        if (wanted.session.empty()) throw CLI::RequiredError("SESSION");
        return certify(daemon, wanted);
      });
  auto* session = command->add_option("SESSION", given->session);
  add_output(*command, given->output);
  command->add_option("--issued-by", given->issued_by);
  command->add_flag_callback("--no-pdf", [given] { given->pdf = false; });
  command->add_option("--key", given->key);
  command->add_option("--export-key", given->export_key);
  command->add_flag_callback("--no-sign", [given] { given->sign = false; });
  command->add_flag("--make-key", given->make_key)->excludes(session);
}

void add_verify(CLI::App& app, int& status) {
  const auto [command, given] = add_command(app, status, "verify", verify);
  command->add_option("FILE", given->file)->required();
  command->add_option("--key", given->key);
  add_json(*command, given->json);
}

void add_versions(CLI::App& app, int& status) {
  const auto [command, given, connection] =
      add_request<std::optional<std::int64_t>>(app, status, "versions", list_versions);
  command->add_option("--of", *given)->check(session_number());
}

void add_activate(CLI::App& app, int& status) {
  struct Given {
    std::optional<std::int64_t> session;
    bool back = false;
    std::string reason;
  };
  const auto [command, given, connection] =
      add_request<Given>(app, status, "activate", [](const Connection& daemon, const Given& of) {
        if (!of.back && !of.session) throw CLI::RequiredError("ID or --back");
        return activate_version(daemon, of.back ? std::nullopt : of.session, of.reason);
      });
  auto* session = command->add_option("ID", given->session)->check(session_number());
  auto* back = command->add_flag("--back", given->back);
  back->excludes(session);
  command->add_option("--reason", given->reason)->required();
}

void add_compare(CLI::App& app, int& status) {
  struct Given {
    std::int64_t before = 0, after = 0;
  };
  const auto [command, given, connection] =
      add_request<Given>(app, status, "compare", [](const Connection& daemon, const Given& of) {
        return compare_versions(daemon, of.before, of.after);
      });
  command->add_option("A", given->before)->required()->check(session_number());
  command->add_option("B", given->after)->required()->check(session_number());
}

}  // namespace

std::string versions_text(const json& list) {
  if (list.empty()) return said("say.cli.versions.none");
  std::string words = said("say.cli.versions.head");
  for (const json& one : list) words += version_line(one);
  return list.size() < kMostVersions ? words : words + said("say.cli.versions.older");
}

std::string comparison_text(const json& all) {
  const auto number = [&](const char* key) { return all[key].get<std::int64_t>(); };
  if (!all["comparable"])
    return said(
        {"say.cli.compare.not", {{"before", number("before")}, {"after", number("after")}}});
  std::string words = said({"say.cli.compare.apart",
                            {{"mean", all["mean_mm"].get<double>()},
                             {"max", all["max_mm"].get<double>()},
                             {"poses", number("poses")},
                             {"scope", scope(all["scope"])}}});
  if (all["expected_mm"].is_number())
    words += said({"say.cli.compare.expected", {{"mm", all["expected_mm"].get<double>()}}});
  for (const auto& [key, session] :
       {std::pair{"only_before", "before"}, std::pair{"only_after", "after"}}) {
    if (all[key].empty()) continue;
    const std::size_t more = all[key].size() - std::min(all[key].size(), kNamed);
    words +=
        said({more > 0 ? "say.cli.compare.only.more" : "say.cli.compare.only",
              {{"session", number(session)}, {"names", names_in(all[key], kNamed)}, {"n", more}}});
  }
  const json not_compared = all.value("not_compared", json::array());
  if (!not_compared.empty())
    words +=
        said({"say.cli.compare.frame", {{"names", names_in(not_compared, not_compared.size())}}});
  if (all["moved"].empty())
    return words +
           said(not_compared.empty() ? "say.cli.compare.none" : "say.cli.compare.none.other");
  words += "\n" + said("say.cli.compare.head");
  for (const json& one : all["moved"])
    words += said({"say.cli.compare.row",
                   {{"name", fmt::format("{:<16}", printable(one["name"].get<std::string>()))},
                    {"before", one["before"].get<double>()},
                    {"after", one["after"].get<double>()},
                    {"difference", one["difference"].get<double>()},
                    {"u", one["expanded"].get<double>()},
                    {"unit", printable(one["unit"].get<std::string>())}}});
  return words;
}

int verify(const VerifyCommand& command) try {
  signing::refuse_unsigned(command.file);  // needs no key
  const signing::PublicKey key(command.key.empty() ? signing::public_part(default_key())
                                                   : command.key);
  const signing::Verified verified = signing::verify_files(command.file, key);
  const signing::Statement& is = verified.statement;
  const bool emulated = is.certificate.starts_with(certificate::kEmulatedNumber);
  return print_result(
      command.json,
      {{"verified", true},
       {"failure", nullptr},
       {"certificate", is.certificate},
       {"emulated", emulated},
       {"signed_by", is.by},
       {"signed_at", is.utc},
       {"key", is.key},
       {"files", verified.files}},
      fmt::format("verified: {}{}\n{}signed by: {}\nsigned at: {}\nkey: {}\nfiles: {}\n",
                  verified.kind == signing::Kind::kExport ? "" : "certificate ", is.certificate,
                  emulated
                      ? "emulated cell: a simulation, no real robot was touched. It certifies no "
                        "robot\n"
                      : "",
                  or_not_stated(is.by), is.utc, is.key, fmt::join(verified.files, ", ")));
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

void add_archive_commands(CLI::App& app, int& status) {
  add_export(app, status);
  add_import(app, status);
  add_replay(app, status);
  add_backup(app, status);
  add_retain(app, status);
}

void add_certificate_commands(CLI::App& app, int& status) {
  add_certificate(app, status);
  add_verify(app, status);
}

void add_versions_commands(CLI::App& app, int& status) {
  add_versions(app, status);
  add_activate(app, status);
  add_compare(app, status);
}

}  // namespace cellcal::daemon
