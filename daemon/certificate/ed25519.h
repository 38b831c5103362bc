#pragma once
// Keys and signatures by Ed25519 (RFC 8032). Files are PEM, as 'openssl genpkey -algorithm ed25519' writes them.

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace cellcal::daemon::signing {

/// Names the file, and says what to do.
struct KeyError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// "FILE.pub", beside the private one.
std::filesystem::path public_part(const std::filesystem::path& key);
/// Both parts of a new key; the private one for its owner alone (mode 0600). Throws KeyError, also where one of
/// them is there already: no key is ever written over.
void make_key(const std::filesystem::path& key);

class PrivateKey {
 public:
  /// Throws KeyError where it cannot be read, others than its owner may read it, or it is another kind of key.
  explicit PrivateKey(const std::filesystem::path& file);
  /// 64 bytes.
  std::string sign(std::string_view text) const;
  /// SHA-256 of the public part (SubjectPublicKeyInfo, DER), hexadecimal.
  std::string fingerprint() const;

 private:
  std::string pem_;
};

/// None where there is no such file; a key that is there, or cannot be looked at, throws KeyError if it cannot be used.
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
