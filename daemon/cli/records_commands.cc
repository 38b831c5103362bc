#include <CLI/CLI.hpp>
#include <memory>

#include "daemon/cli/archive.h"
#include "daemon/cli/certificate.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/versions.h"

namespace cellcal::daemon {

namespace {

void add_export(CLI::App& app, int& status) {
  auto given = std::make_shared<ExportCommand>();
  auto no_sign = std::make_shared<bool>(false);
  CLI::App* command =
      app.add_subcommand("export", "Write a session's rows and files to a directory");
  command->footer(
      "Signed if a key exists (export.sums, export.sums.sig), as certificates are; 'cellcal verify' checks it.\n"
      "Example: cellcal export 7 session-7");
  auto daemon = add_connection(command);
  command->add_option("ID", given->session, "Number of the session")
      ->required()
      ->check(session_number());
  command->add_option("DIR", given->directory, "Directory, new or empty")->required();
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
      "Reports the signer; files changed after signing are refused.\n"
      "Example: cellcal import /var/lib/cellcal/session-7");
  auto daemon = add_connection(command);
  command->add_option("DIR", given->directory, "Directory that 'cellcal export' wrote")->required();
  command->add_option(
      "--key", given->key,
      "Public key of the signer (PEM); by default $CELLCAL_KEY.pub or /etc/cellcal/certificate.key.pub");
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
  command->add_option("FILE", *given, "File, must not exist")->required();
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

namespace {

void add_certificate(CLI::App& app, int& status) {
  auto given = std::make_shared<CertificateCommand>();
  struct Flags {
    bool no_pdf = false, no_sign = false, make_key = false;
  };
  auto flags = std::make_shared<Flags>();
  CLI::App* command =
      app.add_subcommand("certificate", "Write the certificate of a published calibration");
  command->footer(
      "Writes certificate.html, certificate.pdf (needs the package 'weasyprint'), certificate.json and rows.jsonl, the\n"
      "session's rows. "
      "Serial numbers, operator and the artefacts' certificates come from the cell file. A directory needs no "
      "daemon.\nSigned if a key exists (certificate.sums, certificate.sums.sig); 'cellcal verify' checks it.\nThe result is computed again first. A directory is signed for where its export is signed.\n"
      "Status 3 where the result was withheld, is an update or is not reproduced to the bit, where its rows are not\n"
      "verified, or where the session was not completed.\nExample: cellcal certificate 7 --issued-by \"A. Name\"\n"
      "         cellcal certificate session-7 --out certificate-7\n         cellcal certificate --make-key --key quality.key");
  auto daemon = add_connection(command);
  auto* session = command->add_option("SESSION", given->session,
                                      "Number of the session, or directory of its export");
  command->add_option("-o,--output,--out", given->output, "Directory, new or empty");
  command->add_option("--issued-by", given->issued_by, "Issuer");
  command->add_flag("--no-pdf", flags->no_pdf, "Write no PDF");
  command->add_option(
      "--key", given->key,
      "Private key (Ed25519, PEM, mode 0600); $CELLCAL_KEY or /etc/cellcal/certificate.key where it is "
      "there");
  command->add_option("--export-key", given->export_key,
                      "Public key that signed the export of a directory (PEM); by default that of "
                      "--key");
  command->add_flag("--no-sign", flags->no_sign, "Do not sign");
  auto* make_key = command->add_flag("--make-key", flags->make_key, "Only create a new key");
  make_key->excludes(session);
  command->callback([=, &status] {
    if (flags->make_key) {
      status = make_certificate_key(given->key.empty() ? default_key() : given->key, daemon->json);
      return;
    }
    if (given->session.empty()) throw CLI::RequiredError("SESSION");
    given->pdf = !flags->no_pdf;
    given->sign = !flags->no_sign;
    status = certify(*daemon, *given);
  });
}

void add_verify(CLI::App& app, int& status) {
  auto given = std::make_shared<VerifyCommand>();
  CLI::App* command =
      app.add_subcommand("verify", "Show who signed a certificate, and whether it was changed");
  command->footer(
      "Status 0: as it was signed. 3: it is not: changed file, one more in the directory, other key,\n"
      "damaged signature. 1: cannot be verified: no signature, no key, a file is missing.\nExample: cellcal verify certificate-7/certificate.pdf --key quality.key.pub");
  command->add_option("FILE", given->file, "One file of a certificate, or its directory")
      ->required();
  command->add_option(
      "--key", given->key,
      "The issuer's public key (PEM); by default $CELLCAL_KEY.pub or /etc/cellcal/certificate.key.pub");
  command->add_flag("--json", given->json, "Print JSON");
  command->callback([given, &status] { status = verify(*given); });
}

}  // namespace

void add_certificate_commands(CLI::App& app, int& status) {
  add_certificate(app, status);
  add_verify(app, status);
}

namespace {

void add_versions(CLI::App& app, int& status) {
  auto given = std::make_shared<std::int64_t>(0);
  CLI::App* command = app.add_subcommand(
      "versions", "List the published calibrations of a cell, and which is in use");
  command->footer("Example: cellcal versions");
  auto daemon = add_connection(command);
  auto* of =
      command->add_option("--of", *given, "Session of the cell [that of the calibration in use]")
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
      "or activated. Recorded in the journal with author and reason. Corrected programs and frames stay unchanged.\n"
      "Example: cellcal activate 7 --reason \"session 9 was made with a loose torch\"\n"
      "         cellcal activate --back --reason \"loose torch\"");
  auto daemon = add_connection(command);
  auto* session = command->add_option("ID", given->session, "Session of the calibration")
                      ->check(session_number());
  auto* back = command->add_flag("--back", given->back, "The calibration used before this one");
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
      "Prints the distance of the tips over the workspace (or near the targets), and the parameters that moved by more than\n"
      "U (k=2).\nExample: cellcal compare 7 9");
  auto daemon = add_connection(command);
  command->add_option("A", given->before, "First session")->required()->check(session_number());
  command->add_option("B", given->after, "Second session")->required()->check(session_number());
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
