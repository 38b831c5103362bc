#pragma once
// Each function declares its commands; the selected one sets `status` and may throw.

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdint>
#include <memory>
#include <string>

#include "daemon/cli/client.h"

namespace cellcal::daemon {

void add_offline_commands(CLI::App& app, int& status);
/// Offline commands.
void add_correct(CLI::App& app, int& status);
void add_frames(CLI::App& app, int& status);
void add_mastering(CLI::App& app, int& status);
void add_relate(CLI::App& app, int& status);
void add_client_commands(CLI::App& app, int& status);
void add_schedule_commands(CLI::App& app, int& status);
void add_archive_commands(CLI::App& app, int& status);
void add_certificate_commands(CLI::App& app, int& status);
/// Commands of the plant's collector.
void add_fleet_commands(CLI::App& app, int& status);
void add_versions_commands(CLI::App& app, int& status);
void add_proposal_commands(CLI::App& app, int& status);
void add_priors_commands(CLI::App& app, int& status);

/// Declares all commands of cellcal with their help; the selected one sets `status` and may throw.
void describe_cellcal(CLI::App& app, int& status);

/// Adds --socket and --json.
std::shared_ptr<Connection> add_connection(CLI::App* command);

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

}  // namespace cellcal::daemon
