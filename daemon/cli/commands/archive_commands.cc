#include <CLI/CLI.hpp>
#include <memory>

#include "daemon/cli/commands/commands.h"
#include "daemon/cli/commands/connection_options.h"
#include "daemon/cli/commands/session_number.h"
#include "daemon/cli/records/archive.h"
#include "daemon/cli/records/retain.h"

namespace cellcal::daemon {

namespace {

void add_export(CLI::App& app, int& status) {
  auto given = std::make_shared<ExportCommand>();
  auto no_sign = std::make_shared<bool>(false);
  CLI::App* command =
      app.add_subcommand("export", "Write a session's rows and files to a directory");
  command->footer(
      "Signed where there is a key (export.sums, export.sums.sig), as certificates are; 'cellcal verify' checks it.\n"
      "Example: cellcal export 7 session-7");
  auto daemon = add_connection(command);
  command->add_option("ID", given->session, "Number of the session")
      ->required()
      ->check(session_number());
  command->add_option("DIR", given->directory, "Directory; not there yet, or empty")->required();
  command->add_option(
      "--key", given->key,
      "Private key (Ed25519, PEM, mode 0600); $CELLCAL_KEY or /etc/cellcal/certificate.key where it is "
      "there");
  command->add_flag("--no-sign", *no_sign, "Do not sign");
  command->callback([=, &status] {
    given->sign = !*no_sign;
    status = export_session(*daemon, *given);
  });
}

void add_import(CLI::App& app, int& status) {
  struct Given {
    std::filesystem::path directory, key;
  };
  auto given = std::make_shared<Given>();
  CLI::App* command = app.add_subcommand("import", "Import an exported session into this journal");
  command->footer(
      "The daemon reads the directory: put it where its user may, not below /tmp or a home.\n"
      "Says who signed it; what was changed after it was signed is refused.\n"
      "Example: cellcal import /var/lib/cellcal/session-7");
  auto daemon = add_connection(command);
  command->add_option("DIR", given->directory, "Directory that 'cellcal export' wrote")->required();
  command->add_option(
      "--key", given->key,
      "Public key of who signed it (PEM); by default $CELLCAL_KEY.pub or /etc/cellcal/certificate.key.pub");
  command->callback(
      [=, &status] { status = import_session(*daemon, given->directory, given->key); });
}

void add_replay(CLI::App& app, int& status) {
  auto given = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("replay", "Compute a recorded session again and compare");
  command->footer(
      "A directory needs no daemon. Status 1 where a value differs.\n"
      "Example: cellcal replay 7\n         cellcal replay session-7");
  auto daemon = add_connection(command);
  command->add_option("SESSION", *given, "Number of the session, or directory of its export")
      ->required();
  command->callback([=, &status] { status = replay_session(*daemon, *given); });
}

void add_backup(CLI::App& app, int& status) {
  auto given = std::make_shared<std::filesystem::path>();
  CLI::App* command =
      app.add_subcommand("backup", "Copy the whole journal, also while a session runs");
  command->footer(
      "The daemon writes the file: name a directory where its user may.\n"
      "Example: cellcal backup /var/lib/cellcal/journal-2026-11-20.db");
  auto daemon = add_connection(command);
  command->add_option("FILE", *given, "File; must not be there yet")->required();
  command->callback([=, &status] { status = back_up(*daemon, *given); });
}

void add_retain(CLI::App& app, int& status) {
  struct Given {
    bool dry_run = false;
    int days = 0;
    double megabytes = 0.0;
  };
  auto given = std::make_shared<Given>();
  CLI::App* command =
      app.add_subcommand("retain", "Drop raw events and readings of old sessions, nothing else");
  command->footer(
      "Touches, calibrations and results stay, and so do the checksums. Default: [retention] of "
      "cellcald.toml.\nExample: cellcal retain --days 90 --dry-run");
  auto daemon = add_connection(command);
  command->add_flag("--dry-run", given->dry_run, "Only list what would be dropped");
  auto* days =
      command->add_option("--days", given->days, "Sessions that ended more than this many days ago")
          ->check(CLI::Range(1, 36500));
  auto* megabytes =
      command
          ->add_option("--megabytes", given->megabytes,
                       "The oldest sessions, until the journal uses no more than this")
          ->check(CLI::Range(1.0, 1e9));
  command->callback([=, &status] {
    status = retain(*daemon, given->dry_run,
                    days->count() > 0 ? std::optional(given->days) : std::nullopt,
                    megabytes->count() > 0 ? std::optional(given->megabytes) : std::nullopt);
  });
}

}  // namespace

void add_archive_commands(CLI::App& app, int& status) {
  add_export(app, status);
  add_import(app, status);
  add_replay(app, status);
  add_backup(app, status);
  add_retain(app, status);
}

}  // namespace cellcal::daemon
