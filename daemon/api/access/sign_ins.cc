#include "daemon/api/access/sign_ins.h"

#include <openssl/crypto.h>

#include <algorithm>

#include "calib/files/input_file.h"

namespace cellcal::daemon {

namespace {

/// Screens and browsers of one token. Tokens are few: who may add them may do everything.
constexpr std::ptrdiff_t kMostOfOneToken = 32;

bool same(const std::string& a, const std::string& b) {
  return a.size() == b.size() && ::CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

}  // namespace

SignIns::SignIns(const TokenStore& tokens, const std::filesystem::path& file, Clock clock)
    : tokens_(tokens), clock_(std::move(clock)) {
  if (file.empty()) return;
  file_ = std::make_unique<SignInFile>(file);
  all_ = file_->read();
}

/// With the last use of each; a daemon that is killed leaves that of the last sign-in or logout.
SignIns::~SignIns() {
  if (file_) file_->write(all_);
}

std::string SignIns::begin(const Token& token) {
  std::string cookie = random_secret();
  std::erase_if(all_, [&](const SignIn& one) { return !tokens_.find_by_sha256(one.token_sha256); });
  const auto is_own = [&](const SignIn& one) { return one.token_sha256 == token.sha256; };
  if (std::count_if(all_.begin(), all_.end(), is_own) >= kMostOfOneToken)
    all_.erase(std::min_element(all_.begin(), all_.end(), [&](const SignIn& a, const SignIn& b) {
      return std::pair(!is_own(a), a.last) < std::pair(!is_own(b), b.last);
    }));
  all_.push_back({calib::sha256(cookie), token.sha256, clock_()});
  if (file_) file_->write(all_);
  return cookie;
}

void SignIns::end(const std::string& cookie) {
  const std::string digest = calib::sha256(cookie);
  std::erase_if(all_, [&](const SignIn& one) { return same(one.cookie_sha256, digest); });
  if (file_) file_->write(all_);
}

std::optional<Token> SignIns::find(const std::string& cookie) {
  const auto now = clock_();
  std::erase_if(all_, [&](const SignIn& one) { return now - one.last > kLongestUnused; });
  const std::string digest = calib::sha256(cookie);
  const auto found = std::find_if(
      all_.begin(), all_.end(), [&](const SignIn& one) { return same(one.cookie_sha256, digest); });
  if (found == all_.end()) return std::nullopt;
  found->last = now;
  return tokens_.find_by_sha256(found->token_sha256);
}

}  // namespace cellcal::daemon
