#pragma once
// Who may come in over the network, and what he has to say before anything moves.
//
// In this order: the Host must be this computer's; what changes something must not come from another
// page; then the token, as 'Authorization: Bearer' or by the cookie that a login gave; then its role.
// A token that is none costs its sender time, and nobody else: one that is, is never slowed.

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
  std::vector<std::string> host_names{};  ///< beside addresses and localhost
  std::uint16_t port = 0;
  bool tls = false;
  std::filesystem::path sign_ins{};  ///< where they are kept; empty: they end with the daemon
};

class Access {
 public:
  Access(TokenStore& tokens, AccessConfig config)
      : tokens_(tokens), config_(std::move(config)), sign_ins_(tokens_, config_.sign_ins) {}

  // On the network's thread.
  /// Sets Request::caller, or refuses.
  std::optional<Response> admit(Request& request, Role needed);
  Response log_in(const Request& request);
  /// The stream, which ends with the token or the login that it was asked for with.
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
