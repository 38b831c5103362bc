// cellcal: the offline tool and the daemon's client.

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>

#include "calib/files/calibration_json.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/exit_status.h"

namespace {

/// The command that was named, for the front of an error.
std::string command_of(const CLI::App& app) {
  const auto named = app.get_subcommands();
  return named.empty() ? "cellcal" : "cellcal " + named.front()->get_name();
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
