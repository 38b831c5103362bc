#pragma once
// Signature of the files of one directory, with signer and time: `certificate.sums` (of an export
// `export.sums`) in the format of 'sha256sum -c', and its detached signature `certificate.sums.sig` in that
// of 'openssl pkeyutl -verify'.

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "calib/model/enum_table.h"

namespace cellcal::daemon::signing {

// Keys and signatures by Ed25519 (RFC 8032). Files are PEM, as written by 'openssl genpkey -algorithm
// ed25519'.

/// The text names the file and the remedy.
struct KeyError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// "FILE.pub", in the private key's directory.
std::filesystem::path public_part(const std::filesystem::path& key);
/// Creates both parts of a new key; the private one is readable by its owner only (mode 0600). Throws
/// KeyError, also where either file exists: keys are never overwritten.
void make_key(const std::filesystem::path& key);

class PrivateKey {
 public:
  /// Throws KeyError where the file is unreadable, accessible to others or of another key type.
  explicit PrivateKey(const std::filesystem::path& file);
  /// 64 bytes.
  std::string sign(std::string_view text) const;
  /// SHA-256 of the public part (SubjectPublicKeyInfo, DER), hexadecimal.
  std::string fingerprint() const;

 private:
  std::string pem_;
};

/// None where the file does not exist; an existing but unusable or inaccessible key throws KeyError.
std::optional<PrivateKey> key_if_there(const std::filesystem::path& file);

class PublicKey {
 public:
  /// Throws KeyError, which names the `option` for another file.
  explicit PublicKey(const std::filesystem::path& file, const char* option = "--key");
  bool verifies(std::string_view text, std::string_view signature) const;
  std::string fingerprint() const;

 private:
  std::string pem_;
};

inline constexpr std::size_t kSignatureBytes = 64;

/// Signed statement accompanying the files.
struct Statement {
  std::string certificate;  ///< its number; of an export its description
  std::string by;           ///< empty: not stated
  std::string utc;
  std::string key;  ///< fingerprint
};

inline constexpr const char* kSums = "certificate.sums";
inline constexpr const char* kSignature = "certificate.sums.sig";
inline constexpr const char* kExportSums = "export.sums";
inline constexpr const char* kExportSignature = "export.sums.sig";

/// Kind of the signed directory, which determines the names of its sums and signature.
enum class Kind { kCertificate, kExport };

/// Signs the listed files of the directory; `statement.key` is set to the key's fingerprint. Throws KeyError,
/// calib::FileError, std::runtime_error.
void sign_files(const std::filesystem::path& directory, const std::vector<std::string>& names,
                Statement statement, const PrivateKey& key, Kind kind = Kind::kCertificate);

struct Verified {
  Kind kind = Kind::kCertificate;
  Statement statement;
  /// Verified files, by their signed names.
  std::vector<std::string> files;
};

/// The files differ from the signed ones, or cannot be verified.
struct NotVerified : std::runtime_error {
  enum class Why {
    kNoSignature,       ///< no signature in the directory
    kDamagedSignature,  ///< the signature does not match the sums
    kOtherKey,          ///< signed by another key
    kChangedFile,
    kNotListed,    ///< not among the signed files
    kMissingFile,  ///< of the directory
  };
  NotVerified(Why reason, const std::string& words) : std::runtime_error(words), why(reason) {}
  Why why;
};
/// "changed_file"
constexpr const char* to_string(NotVerified::Why why) { return own_name(why); }

/// True if the directory contains a signature of that kind, valid or not.
bool has_signature(const std::filesystem::path& directory, Kind kind);

/// Throws NotVerified where the file's folder, or this folder, has no signature; calib::FileError for a missing
/// file.
void refuse_unsigned(const std::filesystem::path& file);

/// Verifies one file, renamed or not, unless its name belongs to another signed file; or a whole directory,
/// which must contain nothing else. In a directory with both kinds the certificate is verified, unless `kind`
/// is given. Throws NotVerified; calib::FileError, std::runtime_error where a file cannot be read.
Verified verify_files(const std::filesystem::path& file, const PublicKey& key,
                      std::optional<Kind> kind = {});

}  // namespace cellcal::daemon::signing
