#pragma once
// Each function declares its commands; the one that was named sets `status` and may throw.

#include <functional>

namespace CLI {
class App;
}

namespace cellcal::daemon {

void add_offline_commands(CLI::App& app, int& status);
/// Of the offline commands.
void add_correct(CLI::App& app, int& status);
void add_frames(CLI::App& app, int& status);
void add_client_commands(CLI::App& app, int& status);
void add_schedule_commands(CLI::App& app, int& status);
void add_archive_commands(CLI::App& app, int& status);
void add_certificate_commands(CLI::App& app, int& status);
/// Of the plant's collector.
void add_fleet_commands(CLI::App& app, int& status);
void add_versions_commands(CLI::App& app, int& status);
void add_proposal_commands(CLI::App& app, int& status);
void add_priors_commands(CLI::App& app, int& status);

}  // namespace cellcal::daemon
