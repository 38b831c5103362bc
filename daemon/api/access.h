#pragma once
// Admission of network requests, and the confirmation required before motion.
//
// Checks in this order: the Host header must name this computer; a request that changes something must not
// come from another page; then the token, as 'Authorization: Bearer' or by the cookie of a login; then its
// role. An invalid token delays its sender only; a valid one is never slowed.

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "daemon/api/http/http.h"
#include "daemon/api/tokens.h"
#include "daemon/service/request.h"

namespace cellcal::daemon {

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
  /// To be called after each change of the status.
  void look(const Status& status);

 private:
  struct Acknowledgement {
    std::string name;
    std::chrono::steady_clock::time_point until;
  };
  Clock clock_;
  std::mutex mutex_;
  std::optional<Acknowledgement> acknowledged_, taken_;
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
  std::string cookie_name() const;
  std::string cookie_of(const Request& request) const;

  TokenStore& tokens_;
  AccessConfig config_;
  SignIns sign_ins_;
  FailedAttempts failed_;
  Clearance clearance_;
};

}  // namespace cellcal::daemon
