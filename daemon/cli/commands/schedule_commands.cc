#include <CLI/CLI.hpp>
#include <memory>

#include "daemon/cli/commands/commands.h"
#include "daemon/cli/commands/connection_options.h"
#include "daemon/cli/schedule.h"

namespace cellcal::daemon {

void add_schedule_commands(CLI::App& app, int& status) {
  struct Given {
    bool release = false;
    std::string begin;
  };
  auto given = std::make_shared<Given>();
  CLI::App* command = app.add_subcommand(
      "schedule", "Show what begins without a person: next times, last decisions and why");
  command->footer(
      "Its sessions are [[schedule.session]] in cellcald.toml.\nExample: cellcal schedule\n"
      "         cellcal schedule --release\n         cellcal schedule --begin check");
  auto daemon = add_connection(command);
  auto* release = command->add_flag(
      "--release", given->release,
      "Confirm that cell, arm and this computer's clock were checked: scheduled sessions begin again");
  command
      ->add_option("--begin", given->begin,
                   "Begin this session, if the schedule allows it now (begin = \"on request\")")
      ->excludes(release);
  command->callback([=, &status] {
    status = given->release          ? release_schedule(*daemon)
             : !given->begin.empty() ? begin_scheduled(*daemon, given->begin)
                                     : show_schedule(*daemon);
  });
}

}  // namespace cellcal::daemon
