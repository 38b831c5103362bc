#include <CLI/CLI.hpp>
#include <memory>

#include "daemon/cli/commands/commands.h"
#include "daemon/cli/commands/connection_options.h"
#include "daemon/cli/records/certificate.h"

namespace cellcal::daemon {

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
      "daemon.\nSigned where there is a key (certificate.sums, certificate.sums.sig); 'cellcal verify' checks it.\nThe result is computed again first. A directory is signed for where its export is signed.\n"
      "Status 3 where the result was withheld, is an update, does not come out the same to the bit, nobody vouches for\n"
      "its rows, or the session was not done.\nExample: cellcal certificate 7 --issued-by \"A. Name\"\n"
      "         cellcal certificate session-7 --out certificate-7\n         cellcal certificate --make-key --key quality.key");
  auto daemon = add_connection(command);
  auto* session = command->add_option("SESSION", given->session,
                                      "Number of the session, or directory of its export");
  command->add_option("-o,--output,--out", given->output, "Directory; not there yet, or empty");
  command->add_option("--issued-by", given->issued_by, "Who issues it");
  command->add_flag("--no-pdf", flags->no_pdf, "Write no PDF");
  command->add_option(
      "--key", given->key,
      "Private key (Ed25519, PEM, mode 0600); $CELLCAL_KEY or /etc/cellcal/certificate.key where it is "
      "there");
  command->add_option(
      "--export-key", given->export_key,
      "Of a directory: public key that its export is signed with (PEM); by default that of "
      "--key");
  command->add_flag("--no-sign", flags->no_sign, "Do not sign");
  auto* make_key =
      command->add_flag("--make-key", flags->make_key, "Make a new key, and nothing else");
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

}  // namespace cellcal::daemon
