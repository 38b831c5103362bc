#pragma once
// Certificate of a published calibration: issue, signature and verification. Each function returns its exit
// status and throws on failure.

#include <filesystem>
#include <optional>
#include <string>

#include "daemon/certificate/signed_files.h"
#include "daemon/cli/client.h"

namespace cellcal::daemon {

struct CertificateCommand {
  std::string session;           ///< number, or the directory of an export
  std::filesystem::path output;  ///< directory, new or empty; empty: "certificate-NUMBER"
  std::string issued_by;
  bool pdf = true, sign = true;
  std::filesystem::path key;  ///< empty: default_key(), if it exists
  /// Public part of the key that signed the export, where the session is a directory; empty: that of `key`.
  std::filesystem::path export_key;
};
/// $CELLCAL_KEY, otherwise in /etc/cellcal.
std::filesystem::path default_key();

struct SigningKey {
  signing::PrivateKey key;
  std::filesystem::path file;
};
/// The named key, or default_key() if it exists; none where nothing is to be signed. Throws
/// signing::KeyError.
std::optional<SigningKey> signing_key(const std::filesystem::path& named, bool sign);

int certify(const Connection& daemon, const CertificateCommand& command);
int make_certificate_key(const std::filesystem::path& key, bool json);

struct VerifyCommand {
  std::filesystem::path file;  ///< or the directory of a certificate
  std::filesystem::path key;   ///< public part; empty: that of default_key()
  bool json = false;
};
int verify(const VerifyCommand& command);

}  // namespace cellcal::daemon
