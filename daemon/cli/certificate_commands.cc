#include <CLI/CLI.hpp>
#include <memory>

#include "daemon/cli/certificate.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/connection_options.h"

namespace cellcal::daemon {

namespace {

void add_certificate(CLI::App& app, int& status) {
  auto given = std::make_shared<CertificateCommand>();
  auto no_pdf = std::make_shared<bool>(false);
  CLI::App* command =
      app.add_subcommand("certificate", "Write the certificate of a published calibration");
  command->footer(
      "Writes certificate.html, certificate.pdf (needs the package 'weasyprint') and certificate.json.\n"
      "Serial numbers, operator and the artefacts' certificates stand in the cell file. A directory needs no "
      "daemon.\nStatus 3 where the result was withheld.\nExample: cellcal certificate 7 --issued-by \"A. Name\"\n"
      "         cellcal certificate session-7 --out certificate-7");
  auto daemon = add_connection(command);
  command->add_option("SESSION", given->session, "Number of the session, or directory of its export")
      ->required();
  command->add_option("--out", given->output, "Directory; not there yet, or empty");
  command->add_option("--issued-by", given->issued_by, "Who issues it");
  command->add_flag("--no-pdf", *no_pdf, "Write no PDF");
  command->callback([=, &status] {
    given->pdf = !*no_pdf;
    status = certify(*daemon, *given);
  });
}

}  // namespace

void add_certificate_commands(CLI::App& app, int& status) { add_certificate(app, status); }

}  // namespace cellcal::daemon
