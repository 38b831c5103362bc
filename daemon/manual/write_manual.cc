// cellcal-manual FOLDER: writes manual pages and completions of cellcal, cellcald, cellcal-fleet and
// cellcal-plant. Run during the build; not installed.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <filesystem>

#include "calib/files/calibration_json.h"
#include "daemon/cli/commands.h"
#include "daemon/files/atomic_file.h"
#include "daemon/files/service_options.h"
#include "daemon/manual/man_page.h"

namespace cellcal::daemon {
// Sections besides options: NAME.roff.
extern const std::string_view kCellcalSections, kCellcaldSections, kFleetSections, kPlantSections;
}  // namespace cellcal::daemon

namespace {

using namespace cellcal::daemon;

void write(const ManPage& page, const std::filesystem::path& folder) {
  const std::string& name = page.help.name;
  write_atomically(folder / (name + "." + std::to_string(page.section)), man_page(page));
  write_atomically(folder / (name + ".bash"), bash_completion(page.help));
  write_atomically(folder / ("_" + name), zsh_completion(page.help));
  write_atomically(folder / (name + ".fish"), fish_completion(page.help));
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 2) {
    std::fputs("usage: cellcal-manual FOLDER\n", stderr);
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  std::filesystem::create_directories(folder);
  const std::string version = cellcal::calib::software_version();
  int status = 0;
  CLI::App client, daemon, collector, line;
  describe_cellcal(client, status);
  DaemonOptions options;
  describe_cellcald(daemon, options);
  FleetOptions fleet_options;
  describe_cellcal_fleet(collector, fleet_options);
  PlantOptions plant_options;
  describe_cellcal_plant(line, plant_options);
  write({command_tree(client), 1, version, kCellcalSections, {"cellcald(8)"}}, folder);
  write({command_tree(daemon), 8, version, kCellcaldSections, {"cellcal(1)", "systemctl(1)"}},
        folder);
  write({command_tree(collector),
         8,
         version,
         kFleetSections,
         {"cellcal(1)", "cellcald(8)", "mosquitto(8)"}},
        folder);
  write({command_tree(line), 8, version, kPlantSections, {"cellcald(8)", "mosquitto(8)"}}, folder);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "cellcal-manual: %s\n", error.what());
  return 1;
}
