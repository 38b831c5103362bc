#pragma once
// Admission of network requests, and the confirmation required before motion.
//
// Checks in this order: the Host header must name this computer; a request that changes something must not
// come from another page; then the token, as 'Authorization: Bearer' or by the cookie of a login; then its
// role. An invalid token delays its sender only; a valid one is never slowed.

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "daemon/api/http/http.h"
#include "daemon/service/status.h"

namespace cellcal::daemon {

// Named tokens with roles for network access, in one file readable by the daemon only.
//
// A token is 256 bits from the system's random generator. The file holds its SHA-256: a slow, salted hash
// protects secrets short enough to be guessed, which 2^256 excludes, and no token can be derived from the
// file.

/// A token cannot be added or removed; the text gives reason and remedy.
struct TokenError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct Token {
  std::string name;
  Role role = Role::kNone;
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

// Counts invalid tokens per address and derives the delay of the answer.

/// Not thread-safe.
class FailedAttempts {
 public:
  using Clock = std::function<std::chrono::steady_clock::time_point()>;
  explicit FailedAttempts(Clock clock = std::chrono::steady_clock::now)
      : clock_(std::move(clock)) {}

  struct Count {
    int so_far = 0;
    std::chrono::milliseconds wait{0};  ///< doubles each time, up to 5 s
  };
  /// Counts one more attempt. Attempts older than ten minutes are dropped.
  Count add(const std::string& address);

 private:
  struct Of {
    int count = 0;
    std::chrono::steady_clock::time_point last;
  };
  Clock clock_;
  std::map<std::string, Of> of_;  ///< by address; IPv6 by network, all of which one host may use
};

// Confirmation 'the cell is clear' of an operator who starts motion remotely. Valid for that operator's next
// run, for five minutes, and void once a session has begun, failed or been aborted.

inline constexpr std::chrono::seconds kClearanceLasts{300};

/// Thread-safe.
class Clearance {
 public:
  using Clock = std::function<std::chrono::steady_clock::time_point()>;
  explicit Clearance(Clock clock = std::chrono::steady_clock::now) : clock_(std::move(clock)) {}

  void acknowledge(const std::string& name);
  /// Consumes the confirmation for a run. False: not confirmed by this caller, or expired.
  bool take(const std::string& name);
  /// Restores the confirmation of a run that was refused before anything happened.
  void put_back(const std::string& name);
  void forget();
  /// To be called after each change of the status, in order.
  void update(const Status& status);

 private:
  struct Acknowledgement {
    std::string name;
    std::chrono::steady_clock::time_point until;
  };
  Clock clock_;
  std::mutex mutex_;
  std::optional<Acknowledgement> acknowledged_, taken_;
  std::pair<std::int64_t, Phase> newest_{0, Phase::kIdle};  ///< last updated to
};

struct AccessConfig {
  std::vector<std::string> host_names{};  ///< besides addresses and localhost
  std::uint16_t port = 0;
  bool tls = false;
  std::filesystem::path sign_ins{};  ///< file of the sign-ins; empty: they end with the daemon
};

class Access {
 public:
  Access(TokenStore& tokens, AccessConfig config)
      : tokens_(tokens), config_(std::move(config)), sign_ins_(tokens_, config_.sign_ins) {}

  // On the network thread.
  /// Sets Request::caller, or returns the refusal.
  std::optional<Response> admit(Request& request, Role needed);
  Response log_in(const Request& request);
  /// Wraps the stream: it ends with the token or the login of its request.
  std::shared_ptr<Stream> while_admitted(const Request& request, std::shared_ptr<Stream> stream);
  Response log_out(const Request& request);

  TokenStore& tokens() { return tokens_; }
  Clearance& clearance() { return clearance_; }

 private:
  class Admitted;
  std::optional<Token> token_of(const Request& request);
  Response wrong_token(const Request& request);
  Response ended_sign_in() const;
  std::string no_cookie() const;
  std::string cookie_name() const;
  std::string cookie_of(const Request& request) const;

  TokenStore& tokens_;
  AccessConfig config_;
  SignIns sign_ins_;
  FailedAttempts failed_;
  Clearance clearance_;
};

}  // namespace cellcal::daemon
