#include <CLI/CLI.hpp>
#include <memory>

#include "daemon/cli/commands/commands.h"
#include "daemon/cli/commands/connection_options.h"
#include "daemon/cli/plant/proposals.h"

namespace cellcal::daemon {

namespace {

/// Letters that a path of the API carries as they are; the daemon looks whether there is such a proposal.
const CLI::Validator kId(
    [](std::string& text) {
      const bool sound = !text.empty() &&
                         text.find_first_not_of(
                             "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") ==
                             std::string::npos;
      return sound ? std::string() : std::string("a proposal's id has letters, digits, _ and -");
    },
    "ID");

}  // namespace

void add_proposal_commands(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand(
      "proposals", "List what the plant proposed to this cell; accept or refuse it");
  command->footer(
      "A proposal moves nothing, neither when it comes nor when it is accepted.\n"
      "Example: cellcal proposals\n         cellcal proposals accept p-17\n"
      "         cellcal proposals refuse p-17 --reason \"the torch is changed tomorrow\"");
  command->require_subcommand(0, 1);
  auto daemon = add_connection(command);
  struct Given {
    std::string id, reason;
  };
  auto given = std::make_shared<Given>();
  CLI::App* accept =
      command->add_subcommand("accept", "Accept a proposal, and print what to do now");
  CLI::App* refuse = command->add_subcommand("refuse", "Refuse a proposal");
  accept->footer("Example: cellcal proposals accept p-17");
  refuse->footer(
      "Example: cellcal proposals refuse p-17 --reason \"the torch is changed tomorrow\"");
  for (CLI::App* one : {accept, refuse}) {
    one->add_option("ID", given->id, "Of the proposal, as 'cellcal proposals' has it")
        ->required()
        ->check(kId);
    auto* reason = one->add_option("--reason", given->reason, "Why, for those who proposed it");
    if (one == refuse) reason->required();
  }
  command->callback([=, &status] {
    if (*accept)
      status = accept_proposal(*daemon, given->id, given->reason);
    else if (*refuse)
      status = refuse_proposal(*daemon, given->id, given->reason);
    else
      status = list_proposals(*daemon);
  });
}

}  // namespace cellcal::daemon
