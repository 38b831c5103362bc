#pragma once
// Browsers that logged in. Their cookie is no token: it ends with a logout, with the token, with the
// daemon, or 30 days after it was last used, which following is as well.

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "daemon/api/access/tokens.h"

namespace cellcal::daemon {

inline constexpr std::chrono::hours kLongestUnused{30 * 24};

/// On one thread.
class SignIns {
 public:
  using Clock = std::function<std::chrono::steady_clock::time_point()>;
  explicit SignIns(const TokenStore& tokens, Clock clock = std::chrono::steady_clock::now)
      : tokens_(tokens), clock_(std::move(clock)) {}

  /// What the cookie holds. Of too many logins with one token the one that was not used for longest ends;
  /// those with other tokens stay.
  std::string begin(const Token& token);
  void end(const std::string& cookie);
  /// Nothing: none of that name, or no longer.
  std::optional<Token> find(const std::string& cookie);

 private:
  struct SignIn {
    std::string cookie_sha256, token_sha256;
    std::chrono::steady_clock::time_point last;
  };
  const TokenStore& tokens_;
  Clock clock_;
  std::vector<SignIn> all_;
};

}  // namespace cellcal::daemon
