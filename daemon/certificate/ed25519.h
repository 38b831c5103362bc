#pragma once
// Keys and signatures by Ed25519 (RFC 8032). Files are PEM, as written by 'openssl genpkey -algorithm
// ed25519'.

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace cellcal::daemon::signing {

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
  /// Throws KeyError.
  explicit PublicKey(const std::filesystem::path& file);
  bool verifies(std::string_view text, std::string_view signature) const;
  std::string fingerprint() const;

 private:
  std::string pem_;
};

inline constexpr std::size_t kSignatureBytes = 64;

}  // namespace cellcal::daemon::signing
