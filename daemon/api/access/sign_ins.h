#pragma once
// Browsers that logged in. Their cookie is no token: it ends with a logout, with the token, or 30 days after it was last
// used, which following is as well. It outlives the daemon where there is a file for it.

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/api/access/sign_in_file.h"
#include "daemon/api/access/tokens.h"

namespace cellcal::daemon {

inline constexpr std::chrono::hours kLongestUnused{30 * 24};

/// On one thread.
class SignIns {
 public:
  using Clock = std::function<std::chrono::system_clock::time_point()>;
  /// `file`: empty: none.
  explicit SignIns(const TokenStore& tokens, const std::filesystem::path& file = {},
                   Clock clock = std::chrono::system_clock::now);
  ~SignIns();
  SignIns(const SignIns&) = delete;
  SignIns& operator=(const SignIns&) = delete;

  /// What the cookie holds. Of too many logins with one token the one that was not used for longest ends;
  /// those with other tokens stay.
  std::string begin(const Token& token);
  void end(const std::string& cookie);
  /// Nothing: none of that name, or no longer.
  std::optional<Token> find(const std::string& cookie);

 private:
  const TokenStore& tokens_;
  Clock clock_;
  std::vector<SignIn> all_;
  std::unique_ptr<SignInFile> file_;
};

}  // namespace cellcal::daemon
