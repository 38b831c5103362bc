#include "daemon/cli/certificate.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "calib/files/calibration_json.h"
#include "daemon/certificate/certificate.h"
#include "daemon/cli/archive.h"
#include "daemon/cli/offline/exit_status.h"
#include "daemon/cli/offline/offline.h"
#include "daemon/files/atomic_file.h"
#include "daemon/runner/backend.h"

namespace cellcal::daemon {

namespace {

namespace fs = std::filesystem;

/// Nothing of an earlier certificate is written over.
void make_directory(const fs::path& directory) {
  std::error_code code;
  if (fs::exists(directory, code) && !fs::is_empty(directory, code))
    throw std::runtime_error(directory.string() + ": is there already and not empty. Name another: --out DIR");
  fs::create_directories(directory);
}

void tell(const Connection& daemon, const certificate::CertificateData& data,
          const fs::path& directory) {
  if (daemon.json)
    put(nlohmann::json{{"number", data.number.text}, {"directory", fs::absolute(directory).string()}}
                .dump() +
            "\n",
        {});
  else
    put(fmt::format("certificate {} in {}\n", data.number.text, directory.string()), {});
}

}  // namespace

int certify(const Connection& daemon, const CertificateCommand& command) try {
  const NamedArchive named = archive_of(daemon, command.session);
  const certificate::CertificateData data = certificate::make_certificate(
      named.archive, named.from, {wall_clock_utc(), command.issued_by, calib::software_version()});
  const fs::path directory =
      command.output.empty() ? fs::path("certificate-" + data.number.text) : command.output;
  make_directory(directory);
  write_atomically(directory / "certificate.json", certificate::to_json(data));
  write_atomically(directory / "certificate.html", certificate::to_html(data));
  if (command.pdf)
    certificate::write_pdf(directory / "certificate.html", directory / "certificate.pdf");
  tell(daemon, data, directory);
  return kSuccess;
} catch (const certificate::Refused& refused) {
  if (refused.why != certificate::Refused::Why::kWithheld) throw;
  std::fprintf(stderr, "cellcal certificate: %s\n", refused.what());
  return kNotPublishable;
}

}  // namespace cellcal::daemon
