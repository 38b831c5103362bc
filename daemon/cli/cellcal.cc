// cellcal: the offline tool and the daemon's client.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <optional>
#include <string>

#include "calib/files/calibration_json.h"
#include "calib/syntax/shown.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/exit_status.h"

namespace {

/// The command that was named, for the front of an error.
std::string command_of(const CLI::App& app) {
  const auto named = app.get_subcommands();
  return named.empty() ? "cellcal" : "cellcal " + named.front()->get_name();
}

/// The first argument, where it looks like a command and is none. CLI11 would only say that one is
/// missing.
std::optional<std::string> unknown_command(const CLI::App& app, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return std::nullopt;
  std::string names;
  for (const CLI::App* command : app.get_subcommands({})) {
    if (command->get_name() == argv[1]) return std::nullopt;
    names += (names.empty() ? "" : ", ") + command->get_name();
  }
  return fmt::format("there is no command \"{}\"; there are {}", cellcal::calib::shown(argv[1]),
                     names);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace cellcal::daemon;
  std::signal(SIGPIPE, SIG_IGN);  // a reader that went away is an error of writing
  int status = kSuccess;
  CLI::App app("Calibrates an industrial robot cell by touching spheres.");
  app.footer("Example: cellcal run --cell cell.toml\nEach command: cellcal COMMAND --help");
  app.set_version_flag("--version", cellcal::calib::software_version());
  app.require_subcommand(1);
  add_client_commands(app, status);
  add_offline_commands(app, status);
  if (const auto words = unknown_command(app, argc, argv)) {
    fmt::print(stderr, "cellcal: {}\nsee 'cellcal --help'\n", *words);
    return kWrongUsage;
  }
  try {
    app.parse(argc, argv);
    return status;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    std::fprintf(stderr, "%s: %s\nsee '%s --help'\n", command_of(app).c_str(), error.what(),
                 command_of(app).c_str());
    return kWrongUsage;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", command_of(app).c_str(), error.what());
    return kJobFailed;
  }
}
