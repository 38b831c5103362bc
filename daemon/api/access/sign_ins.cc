#include "daemon/api/access/sign_ins.h"

#include <openssl/crypto.h>

#include <algorithm>

#include "calib/syntax/input_file.h"

namespace cellcal::daemon {

namespace {

constexpr std::size_t kMost = 256;

bool same(const std::string& a, const std::string& b) {
  return a.size() == b.size() && ::CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

}  // namespace

std::string SignIns::begin(const Token& token) {
  std::string cookie = random_secret();
  if (all_.size() >= kMost) all_.pop_front();
  all_.push_back({calib::sha256(cookie), token.sha256, clock_()});
  return cookie;
}

void SignIns::end(const std::string& cookie) {
  const std::string digest = calib::sha256(cookie);
  std::erase_if(all_, [&](const SignIn& one) { return same(one.cookie_sha256, digest); });
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
