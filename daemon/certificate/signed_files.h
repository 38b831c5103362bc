#pragma once
// Files of one directory with who signed them, and when: `certificate.sums` (of an export `export.sums`), which
// 'sha256sum -c' reads, and its detached signature `certificate.sums.sig`, which 'openssl pkeyutl -verify' reads.

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "daemon/certificate/ed25519.h"

namespace cellcal::daemon::signing {

/// What is signed beside the files themselves.
struct Statement {
  std::string certificate;  ///< its number; of an export whose it is
  std::string by;           ///< empty: not stated
  std::string utc;
  std::string key;  ///< fingerprint
};

inline constexpr const char* kSums = "certificate.sums";
inline constexpr const char* kSignature = "certificate.sums.sig";
inline constexpr const char* kExportSums = "export.sums";
inline constexpr const char* kExportSignature = "export.sums.sig";

/// What a directory holds: its sums and signature have the names of it.
enum class Kind { kCertificate, kExport };

/// Signs these files of the directory; `statement.key` is the key's own. Throws KeyError, calib::FileError,
/// std::runtime_error.
void sign_files(const std::filesystem::path& directory, const std::vector<std::string>& names,
                Statement statement, const PrivateKey& key, Kind kind = Kind::kCertificate);

struct Verified {
  Kind kind = Kind::kCertificate;
  Statement statement;
  std::vector<std::string>
      files;  ///< that are as they were signed, by the names that they were signed by
};

/// They are not what was signed, or nobody can say so.
struct NotVerified : std::runtime_error {
  enum class Why {
    kNoSignature,       ///< there is none beside the file
    kDamagedSignature,  ///< it does not belong to what it is beside
    kOtherKey,          ///< of somebody else than expected
    kChangedFile,
    kNotListed,    ///< another file than was signed, or one more beside them
    kMissingFile,  ///< of the directory's
  };
  NotVerified(Why reason, const std::string& words) : std::runtime_error(words), why(reason) {}
  Why why;
};
/// "changed_file"
const char* to_string(NotVerified::Why why);

/// Whether a directory has any signature of that kind, whatever it is worth.
bool has_signature(const std::filesystem::path& directory, Kind kind);

/// Of one file, whatever it is called by now unless something else was signed by that name; or of all that were signed,
/// where it is their directory, in which nothing else may be. Of a directory that holds sums of both kinds those of a
/// certificate count, unless a kind is asked for. Throws NotVerified; calib::FileError, std::runtime_error
/// where it cannot be read.
Verified verify_files(const std::filesystem::path& file, const PublicKey& key,
                      std::optional<Kind> kind = {});

}  // namespace cellcal::daemon::signing
