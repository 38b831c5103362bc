#pragma once
// Each function declares its commands; the selected one sets `status` and may throw.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "calib/words/phrase.h"
#include "daemon/cli/client.h"

namespace cellcal::daemon {

void add_offline_commands(CLI::App& app, int& status);
/// Offline commands.
void add_correct(CLI::App& app, int& status);
void add_frames(CLI::App& app, int& status);
void add_mastering(CLI::App& app, int& status);
void add_relate(CLI::App& app, int& status);
void add_new_cell_command(CLI::App& app, int& status);
void add_client_commands(CLI::App& app, int& status);
void add_schedule_commands(CLI::App& app, int& status);
void add_archive_commands(CLI::App& app, int& status);
void add_certificate_commands(CLI::App& app, int& status);
/// Commands of the plant's collector.
void add_fleet_commands(CLI::App& app, int& status);
void add_versions_commands(CLI::App& app, int& status);
void add_proposal_commands(CLI::App& app, int& status);
void add_priors_commands(CLI::App& app, int& status);

/// Declares all commands of cellcal with their help (help.txt); the selected one sets `status` and may throw.
void describe_cellcal(CLI::App& app, int& status);

/// Adds --socket and --json.
std::shared_ptr<Connection> add_connection(CLI::App* command);

// Options of many commands.

inline CLI::Option* add_output(CLI::App& command, std::filesystem::path& given) {
  return command.add_option("-o,--output,--out", given);
}
inline void add_json(CLI::App& command, bool& given) {
  command.add_flag("--json", given, "Print JSON");
}
inline void add_withheld(CLI::App& command, bool& given) {
  command.add_flag("--withheld", given, "Accept a withheld calibration, for inspection only");
}

/// Declares a command that `act` carries out with what its options fill; the caller adds them.
template <class Given>
std::pair<CLI::App*, std::shared_ptr<Given>> add_command(CLI::App& parent, int& status,
                                                         const char* name,
                                                         int (*act)(const Given&)) {
  CLI::App* const command = parent.add_subcommand(name);
  auto given = std::make_shared<Given>();
  command->callback([given, act, &status] { status = act(*given); });
  return {command, given};
}

/// A command that asks the daemon.
template <class Given>
struct RequestCommand {
  CLI::App* command;
  std::shared_ptr<Given> given;
  std::shared_ptr<Connection> connection;
};

/// Likewise. `connect` adds its first options.
template <class Given>
RequestCommand<Given> add_request(
    CLI::App& parent, int& status, const char* name,
    std::function<int(const Connection&, const Given&)> act,
    std::shared_ptr<Connection> (*connect)(CLI::App*) = add_connection) {
  CLI::App* const command = parent.add_subcommand(name);
  auto given = std::make_shared<Given>();
  auto daemon = connect(command);
  command->callback(
      [given, daemon, act = std::move(act), &status] { status = act(*daemon, *given); });
  return {command, given, daemon};
}
/// Request without options of its own.
inline void add_plain(CLI::App& parent, int& status, const char* name,
                      int (*act)(const Connection&),
                      std::shared_ptr<Connection> (*connect)(CLI::App*) = add_connection) {
  struct NoOptions {};
  add_request<NoOptions>(
      parent, status, name,
      [act](const Connection& daemon, const NoOptions&) { return act(daemon); }, connect);
}

/// Validator of session numbers.
inline CLI::Validator session_number() {
  return CLI::Validator(
      [](const std::string& text) {
        std::int64_t number = 0;
        const char* const end = text.data() + text.size();
        const auto [at, error] = std::from_chars(text.data(), end, number);
        const bool sound = error == std::errc() && at == end && number > 0;
        return sound ? std::string()
                     : "\"" + text + "\" must be a session's number, a whole one from 1";
      },
      "");
}

/// Validator of a number in that range; CLI::Range calls a decimal comma out of range.
template <class T>
CLI::Validator between(T low, T high) {
  return CLI::Validator(
      [low, high](std::string& text) -> std::string {
        double number = 0.0;
        const char* const end = text.data() + text.size();
        const auto [at, error] =
            std::from_chars(text.data() + (text.starts_with('+') ? 1 : 0), end, number);
        if (error != std::errc() || at != end)
          return "\"" + text + "\" is not a number (use a decimal point)";
        if (std::is_integral_v<T> && number != std::floor(number))
          return text + " is not a whole number";
        return number >= low && number <= high
                   ? ""
                   : fmt::format("{} is not between {} and {}", text, low, high);
      },
      CLI::Range(low, high).get_description());
}

/// Validator of a word from a list.
inline CLI::Validator one_of(const std::vector<std::string>& words) {
  return CLI::Validator(
      [words](const std::string& text) {
        const bool known = std::find(words.begin(), words.end(), text) != words.end();
        return known ? "" : fmt::format("\"{}\" is none of {}", text, fmt::join(words, ", "));
      },
      CLI::IsMember(words).get_description());
}

// Language of a command's sentences.

/// Adds --language.
void add_language(CLI::App& command, std::string& given);
/// Likewise, for say() alone.
void add_language(CLI::App& command);
/// In the language of this command's --language, otherwise of the environment.
std::string say(const calib::Phrase& phrase);
/// As a line of its own; "" for an empty phrase.
std::string said(const calib::Phrase& phrase);
/// "warning: ..." on standard error.
void warn(const calib::Phrase& phrase);
/// As given, otherwise of the first of LC_ALL, LC_MESSAGES and LANG that is set; English without a catalogue of it.
calib::Language language_of(const std::string& given);
/// As given, otherwise of the configuration where that is another than English, otherwise as above.
calib::Language language_of(const std::string& given, const std::filesystem::path& config);

}  // namespace cellcal::daemon
