#include <CLI/CLI.hpp>
#include <memory>

#include "daemon/cli/commands/commands.h"
#include "daemon/cli/commands/connection_options.h"
#include "daemon/cli/commands/session_number.h"
#include "daemon/cli/records/versions.h"

namespace cellcal::daemon {

namespace {

void add_versions(CLI::App& app, int& status) {
  auto given = std::make_shared<std::int64_t>(0);
  CLI::App* command = app.add_subcommand(
      "versions", "List the published calibrations of a cell, and which is in use");
  command->footer("Example: cellcal versions");
  auto daemon = add_connection(command);
  auto* of = command
                 ->add_option("--of", *given,
                              "Of the cell of this session; of the calibration in use without")
                 ->check(session_number());
  command->callback([=, &status] {
    status = list_versions(*daemon, of->count() > 0 ? std::optional(*given) : std::nullopt);
  });
}

void add_activate(CLI::App& app, int& status) {
  struct Given {
    std::int64_t session = 0;
    bool back = false;
    std::string reason;
  };
  auto given = std::make_shared<Given>();
  CLI::App* command = app.add_subcommand("activate", "Put an earlier calibration into use again");
  command->footer(
      "It is what 'cellcal check' checks and what the next result is compared with, until the next one is published\n"
      "or activated. Kept in the journal with who and why. Corrected programs and frames stay unchanged.\n"
      "Example: cellcal activate 7 --reason \"session 9 was made with a loose torch\"\n"
      "         cellcal activate --back --reason \"loose torch\"");
  auto daemon = add_connection(command);
  auto* session = command->add_option("ID", given->session, "Session of the calibration")
                      ->check(session_number());
  auto* back = command->add_flag("--back", given->back, "The one that was in use before this one");
  back->excludes(session);
  command->add_option("--reason", given->reason, "Why")->required();
  command->callback([=, &status] {
    if (!given->back && given->session == 0) throw CLI::RequiredError("ID or --back");
    status = activate_version(*daemon, given->back ? std::nullopt : std::optional(given->session),
                              given->reason);
  });
}

void add_compare(CLI::App& app, int& status) {
  struct Given {
    std::int64_t before = 0, after = 0;
  };
  auto given = std::make_shared<Given>();
  CLI::App* command = app.add_subcommand("compare", "Compare two published calibrations of a cell");
  command->footer(
      "How far the tips lie apart over the workspace (or near the targets), and which parameters moved by more than\n"
      "U (k=2).\nExample: cellcal compare 7 9");
  auto daemon = add_connection(command);
  command->add_option("A", given->before, "Session of the one")
      ->required()
      ->check(session_number());
  command->add_option("B", given->after, "Session of the other")
      ->required()
      ->check(session_number());
  command->callback(
      [=, &status] { status = compare_versions(*daemon, given->before, given->after); });
}

}  // namespace

void add_versions_commands(CLI::App& app, int& status) {
  add_versions(app, status);
  add_activate(app, status);
  add_compare(app, status);
}

}  // namespace cellcal::daemon
