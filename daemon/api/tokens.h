#pragma once
// Named tokens with roles for network access, in one file readable by the daemon only.
//
// A token is 256 bits from the system's random generator. The file holds its SHA-256: a slow, salted hash
// protects secrets short enough to be guessed, which 2^256 excludes, and no token can be derived from the
// file.

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "daemon/api/http/http.h"

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

// Sign-ins of browsers. The cookie is not a token: it ends with a logout, with the token, or 30 days after
// its last use, which includes following the event stream. It survives a restart where a file is given.

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
