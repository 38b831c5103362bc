#pragma once
// Browsers that logged in. Their cookie is no token: it ends with a logout, with the token, or 30 days after it was last
// used, which following is as well. It outlives the daemon where there is a file for it.

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "daemon/api/tokens.h"

namespace cellcal::daemon {

// Sign-ins that outlive the daemon: a file of its own (mode 0600) in the state directory, of digests alone. Who reads it
// gets neither a cookie nor a token from it.

struct SignIn {
  std::string cookie_sha256, token_sha256;       ///< hexadecimal
  std::chrono::system_clock::time_point last{};  ///< use
};

/// Written by a thread of its own: neither an abort nor a request waits for the disk.
class SignInFile {
 public:
  explicit SignInFile(std::filesystem::path file);
  ~SignInFile();  ///< what was given last is on disk, or its failure in the log
  SignInFile(const SignInFile&) = delete;
  SignInFile& operator=(const SignInFile&) = delete;

  /// Nothing, and a warning in the log, where others may read or write the file or it is not as it was written: everybody
  /// signs in again.
  std::vector<SignIn> read() const;
  void write(std::vector<SignIn> all);

 private:
  void write_newest();

  std::filesystem::path file_;
  std::mutex mutex_;
  std::condition_variable news_;
  std::optional<std::vector<SignIn>> newest_;  ///< not written yet
  bool ending_ = false;
  std::thread thread_;
};

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
