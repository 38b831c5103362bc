#pragma once
// Who may come in over the network: named tokens with roles, in one file that only the daemon reads.
//
// A token is 256 bits of the system's random generator. The file holds its SHA-256: a slow hash with
// salt helps where people choose what is short enough to be guessed; of 2^256 nobody guesses one, and
// whoever reads the file gets no token from it.

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

/// A token cannot be added or removed: says why and what to do.
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
  /// The file need not be there. One that cannot be used lets nobody in, and is kept as it is: see
  /// problem().
  explicit TokenStore(std::filesystem::path file);

  /// Empty: there is none. Names the file and what to do.
  const std::string& problem() const { return problem_; }

  // These wait for the disk. They throw TokenError, and std::runtime_error where it cannot be written.
  /// The token, which is kept nowhere.
  std::string add(const std::string& name, Role role, const std::string& utc);
  /// False: there is none of that name.
  bool remove(const std::string& name);

  // These wait for nothing.
  std::vector<Token> list() const;
  /// Nothing: unknown, or removed. Takes as long whichever it is.
  std::optional<Token> find(std::string_view token) const;
  std::optional<Token> find_by_sha256(std::string_view sha256) const;

 private:
  using Tokens = std::vector<Token>;
  std::shared_ptr<const Tokens> tokens() const;
  void store(Tokens next);

  std::filesystem::path file_;
  std::string problem_;
  std::mutex writing_;
  mutable std::mutex mutex_;  ///< of the pointer
  std::shared_ptr<const Tokens> tokens_;
};

/// 256 random bits, hexadecimal. Throws std::runtime_error where the system has none.
std::string random_secret();

/// Letters, digits, '.', '_' and '-', 1 to 64 of them.
bool is_token_name(std::string_view name);

}  // namespace cellcal::daemon
