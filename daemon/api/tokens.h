#pragma once
// Named tokens with roles for network access, in one file readable by the daemon only.
//
// A token is 256 bits from the system's random generator. The file holds its SHA-256: a slow, salted hash
// protects secrets short enough to be guessed, which 2^256 excludes, and no token can be derived from the
// file.

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/api/http/message.h"

namespace cellcal::daemon {

/// A token cannot be added or removed; the text gives reason and remedy.
struct TokenError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct Token {
  std::string name;
  Role role = Role::kNobody;
  std::string sha256;   ///< hexadecimal
  std::string created;  ///< ISO 8601 UTC
};

class TokenStore {
 public:
  /// The file may be missing. An unusable one admits no token and is left unchanged: see problem().
  explicit TokenStore(std::filesystem::path file);

  /// Names the file and the remedy; empty: no problem.
  const std::string& problem() const { return problem_; }

  // These block on the disk. They throw TokenError, and std::runtime_error where the file cannot be written.
  /// Returns the token, which is stored nowhere.
  std::string add(const std::string& name, Role role, const std::string& utc);
  /// False: no token of that name.
  bool remove(const std::string& name);

  // These do not block.
  std::vector<Token> list() const;
  /// None: unknown or removed. Constant time.
  std::optional<Token> find(std::string_view token) const;
  std::optional<Token> find_by_sha256(std::string_view sha256) const;

 private:
  using Tokens = std::vector<Token>;
  std::shared_ptr<const Tokens> tokens() const;
  void store(Tokens next);

  std::filesystem::path file_;
  std::string problem_;
  std::mutex writing_;
  mutable std::mutex mutex_;  ///< guards the pointer
  std::shared_ptr<const Tokens> tokens_;
};

/// 256 random bits, hexadecimal. Throws std::runtime_error where the system provides none.
std::string random_secret();

/// 1 to 64 letters, digits, '.', '_' and '-'.
bool is_token_name(std::string_view name);

}  // namespace cellcal::daemon
