#pragma once
// Admission of network requests, and the confirmation required before motion.
//
// Checks in this order: the Host header must name this computer; a request that changes something must not
// come from another page; then the token, as 'Authorization: Bearer' or by the cookie of a login; then its
// role. An invalid token delays its sender only; a valid one is never slowed.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/api/attempts.h"
#include "daemon/api/clearance.h"
#include "daemon/api/http/message.h"
#include "daemon/api/sign_ins.h"
#include "daemon/api/tokens.h"

namespace cellcal::daemon {

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
