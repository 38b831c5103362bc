#include <CLI/CLI.hpp>
#include <memory>

#include "daemon/cli/commands/commands.h"
#include "daemon/cli/offline/priors.h"

namespace cellcal::daemon {

namespace {

void add_learn(CLI::App& priors, int& status) {
  auto given = std::make_shared<LearnPriorsCommand>();
  CLI::App* command = priors.add_subcommand(
      "learn",
      "Learn from published calibrations how far the arms of a model lie from their nominal geometry");
  command->footer(
      "Calibrations (JSON), or directories of them and of what 'cellcal export' wrote, which name the arm by its "
      "serial\nnumber. Each arm counts once. Withheld calibrations, other models and arms that do not fit with the "
      "others are set\naside, and each is named. Exit status 1: too few arms, or not one population.\nExample: cellcal "
      "priors learn calibrations -o priors.toml");
  command->add_option("FROM", given->from, "Calibrations, or directories of them")
      ->required()
      ->check(CLI::ExistingPath);
  command->add_option(
      "--robot", given->robot,
      "The nominal geometry, with tolerances that few arms do not overrule: robot file or shipped robot [that of "
      "most calibrations]");
  command->add_option("--after", given->after,
                      "Earlier priors of the model: the version counts on");
  command->add_option("-o,--output,--out", given->output,
                      "Write the priors to this file (TOML) [standard output]");
  command->add_flag("--json", given->json, "Print priors and what was set aside as JSON");
  command->callback([given, &status] { status = learn_priors(*given); });
}

void add_show_priors(CLI::App& priors, int& status) {
  auto given = std::make_shared<ShowPriorsCommand>();
  CLI::App* command = priors.add_subcommand("show", "Print a file of priors");
  command->footer("Example: cellcal priors show priors.toml");
  command->add_option("FILE", given->file, "Priors (TOML)")->required();
  command->add_flag("--json", given->json, "Print JSON");
  command->callback([given, &status] { status = show_priors(*given); });
}

void add_accept(CLI::App& priors, int& status) {
  auto given = std::make_shared<AcceptPriorsCommand>();
  CLI::App* command = priors.add_subcommand(
      "accept",
      "Write a robot file with the tolerances of its fleet; print each old and new value");
  command->footer(
      "Nothing else of the robot changes; the file that was read is left as it is. Priors of another nominal geometry are\n"
      "refused. The new file is used where a cell file names it.\nExample: cellcal priors accept priors.toml --robot "
      "kr5_r1400 -o my_kr5.toml");
  command->add_option("FILE", given->file, "Priors (TOML)")->required();
  command->add_option("--robot", given->robot, "Robot file, or a shipped robot by its name")
      ->required();
  command->add_option("-o,--output,--out", given->output, "Write the robot to this file")
      ->required();
  command->add_flag("--json", given->json, "Print the changes as JSON");
  command->callback([given, &status] { status = accept_priors(*given); });
}

}  // namespace

void add_priors_commands(CLI::App& app, int& status) {
  CLI::App* priors = app.add_subcommand(
      "priors", "Learn tolerances of a robot model from its arms' calibrations, and use them");
  priors->footer(
      "Example: cellcal priors learn calibrations -o priors.toml\n         cellcal priors show priors.toml\n         "
      "cellcal priors accept priors.toml --robot kr5_r1400 -o my_kr5.toml");
  priors->require_subcommand(1);
  add_learn(*priors, status);
  add_show_priors(*priors, status);
  add_accept(*priors, status);
}

}  // namespace cellcal::daemon
