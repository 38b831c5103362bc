#include "daemon/cli/commands.h"

#include "calib/files/calibration_json.h"
#include "daemon/cli/new_cell.h"

namespace cellcal::daemon {

void describe_cellcal(CLI::App& app, int& status) {
  app.name("cellcal");
  app.description("Calibrates an industrial robot in its cell by touching spheres.");
  app.footer("Example: cellcal run --cell cell.toml\nHelp on a command: cellcal COMMAND --help");
  app.set_version_flag("--version", calib::software_version());
  app.require_subcommand(1);
  add_client_commands(app, status);
  add_new_cell_command(app, status);
  add_schedule_commands(app, status);
  add_archive_commands(app, status);
  add_certificate_commands(app, status);
  add_versions_commands(app, status);
  add_proposal_commands(app, status);
  add_fleet_commands(app, status);
  add_offline_commands(app, status);
  add_priors_commands(app, status);
}

}  // namespace cellcal::daemon
