#pragma once
// Sign-ins of browsers. The cookie is not a token: it ends with a logout, with the token, or 30 days after
// its last use, which includes following the event stream. It survives a restart where a file is given.

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

// Persistent sign-ins: a separate file (mode 0600) in the state directory with digests only, from which
// neither a cookie nor a token can be derived.

struct SignIn {
  std::string cookie_sha256, token_sha256;       ///< hexadecimal
  std::chrono::system_clock::time_point last{};  ///< last use
};

/// Written on a thread of its own: neither an abort nor a request waits for the disk.
class SignInFile {
 public:
  explicit SignInFile(std::filesystem::path file);
  ~SignInFile();  ///< the newest content is on disk, or its failure in the log
  SignInFile(const SignInFile&) = delete;
  SignInFile& operator=(const SignInFile&) = delete;

  /// Empty, with a warning in the log, where the file is accessible to others or malformed: all browsers have
  /// to sign in again.
  std::vector<SignIn> read() const;
  void write(std::vector<SignIn> all);

 private:
  void write_newest();

  std::filesystem::path file_;
  std::mutex mutex_;
  std::condition_variable news_;
  std::optional<std::vector<SignIn>> newest_;  ///< pending write
  bool ending_ = false;
  std::thread thread_;
};

inline constexpr std::chrono::hours kLongestUnused{30 * 24};

/// Not thread-safe.
class SignIns {
 public:
  using Clock = std::function<std::chrono::system_clock::time_point()>;
  /// `file`: empty: not persistent.
  explicit SignIns(const TokenStore& tokens, const std::filesystem::path& file = {},
                   Clock clock = std::chrono::system_clock::now);
  ~SignIns();
  SignIns(const SignIns&) = delete;
  SignIns& operator=(const SignIns&) = delete;

  /// Returns the cookie's value. Beyond the limit of one token its least recently used sign-in ends; those of
  /// other tokens are kept.
  std::string begin(const Token& token);
  void end(const std::string& cookie);
  /// None: unknown or expired.
  std::optional<Token> find(const std::string& cookie);

 private:
  const TokenStore& tokens_;
  Clock clock_;
  std::vector<SignIn> all_;
  std::unique_ptr<SignInFile> file_;
};

}  // namespace cellcal::daemon
