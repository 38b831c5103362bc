#pragma once
// A published calibration as a certificate. Returns the exit status and throws when it failed.

#include <filesystem>
#include <string>

#include "daemon/cli/client.h"

namespace cellcal::daemon {

struct CertificateCommand {
  std::string session;           ///< number, or the directory of an export
  std::filesystem::path output;  ///< directory, not there yet or empty; empty: "certificate-NUMBER"
  std::string issued_by;
  bool pdf = true;
};
int certify(const Connection& daemon, const CertificateCommand& command);

}  // namespace cellcal::daemon
