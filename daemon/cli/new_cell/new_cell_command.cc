#include "daemon/cli/new_cell/new_cell_command.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "daemon/cli/new_cell/new_cell.h"

namespace cellcal::daemon {

void add_new_cell_command(CLI::App& app, int& status) {
  auto given = std::make_shared<NewCellCommand>();
  CLI::App* command = app.add_subcommand("new-cell", "Write a commented cell file with every key");
  command->footer(
      "Asks for what the options leave out; with --robot, --tool and --spheres it asks nothing. "
      "Ctrl-D or\nCtrl-C ends it and nothing is written. Spheres can be taught: jog the tip onto the "
      "top of each and\nenter the axis angles that the pendant shows.\nExit status 1: nothing "
      "written, or no plan can be made of the file yet; the reason is printed.\nExample: cellcal new-cell -o "
      "cell.toml\n         cellcal new-cell -o cell.toml --robot kr6_r900_2 --tool 0,0,250,0,0,0 "
      "--spheres spheres.csv --certificate certificate.csv");
  command->add_option("-o,--output,--out", given->output, "The file to write")
      ->capture_default_str();
  command->add_option("--robot", given->robot, "Shipped robot by name, or path of a robot file");
  command->add_option("--tool", given->tool,
                      "X,Y,Z or X,Y,Z,A,B,C from flange to TCP, as TOOL_DATA (mm, deg)");
  command
      ->add_option(
          "--tool-sigma", given->tool_sigma_mm,
          "1 sigma of X, Y and Z of it, in mm (0.5: measured with four points; 0: exact, the "
          "TCP is not estimated)")
      ->check(CLI::Range(0.0, 1e3));
  command->add_option("--mass", given->mass_kg, "Of all that is on the flange, in kg")
      ->check(CLI::Range(0.0, 1e4));
  command->add_option("--tip-radius", given->tip_radius_mm, "Of the tip, in mm; 0: a point")
      ->check(CLI::Range(0.0, 1e3));
  command->add_option("--spheres", given->spheres,
                      "CSV: id,diameter_mm and, where known, diameter_sigma_mm,x_mm,y_mm,z_mm, "
                      "centre_sigma_mm");
  command->add_option("--certificate", given->certificate,
                      "CSV of certified lengths: from,to,mm,sigma_mm");
  command->add_flag("--force", given->force, "Replace the file where it is there already");
  command->add_flag("--json", given->json, "Print the result as JSON");
  command->callback([given, &status] { status = new_cell(*given, std::cin, std::cerr); });
}

}  // namespace cellcal::daemon
