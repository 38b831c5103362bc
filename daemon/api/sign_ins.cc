#include "daemon/api/sign_ins.h"

#include <openssl/crypto.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "calib/files/input_file.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

/// Screens and browsers of one token. The number of tokens is small, since only administrators add them.
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

/// Writes the last use of each; a killed daemon keeps the times of the last sign-in or logout.
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

namespace {

using nlohmann::json;
using std::chrono::seconds;
using std::chrono::system_clock;

constexpr const char* kSignInFormat = "cellcal.sign-ins/1";
constexpr std::size_t kMostSignInBytes = 16u << 20;  // 32 of each of 1000 tokens

std::string text_of(const std::vector<SignIn>& all) {
  json list = json::array();
  for (const SignIn& one : all)
    list.push_back({{"cookie_sha256", one.cookie_sha256},
                    {"token_sha256", one.token_sha256},
                    {"last_unix_s",
                     std::chrono::duration_cast<seconds>(one.last.time_since_epoch()).count()}});
  return json{{"format", kSignInFormat}, {"sign_ins", list}}.dump(1) + "\n";
}

/// Throws on any malformed content.
std::vector<SignIn> parsed_sign_ins(const std::string& text) {
  const json document = json::parse(text);
  if (document.at("format") != kSignInFormat) throw std::runtime_error("another format");
  std::vector<SignIn> all;
  for (const json& value : document.at("sign_ins")) {
    SignIn one{value.at("cookie_sha256").get<std::string>(),
               value.at("token_sha256").get<std::string>(),
               system_clock::time_point(seconds(value.at("last_unix_s").get<std::int64_t>()))};
    if (!calib::is_sha256(one.cookie_sha256) || !calib::is_sha256(one.token_sha256))
      throw std::runtime_error("a sign-in is malformed");
    all.push_back(std::move(one));
  }
  return all;
}

}  // namespace

SignInFile::SignInFile(std::filesystem::path file)
    : file_(std::move(file)), thread_([this] { write_newest(); }) {}

SignInFile::~SignInFile() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  news_.notify_one();
  thread_.join();
}

std::vector<SignIn> SignInFile::read() const {
  struct stat info {};
  if (::stat(file_.c_str(), &info) != 0) return {};
  try {
    if ((info.st_mode & (S_IRWXG | S_IRWXO)) != 0)
      throw std::runtime_error("accessible to other users");
    return parsed_sign_ins(calib::read_file(file_, kMostSignInBytes));
  } catch (const std::exception& error) {
    spdlog::warn("{}: {}. All browsers have to sign in again", file_.string(), system_words(error));
    return {};
  }
}

void SignInFile::write(std::vector<SignIn> all) {
  {
    const std::lock_guard lock(mutex_);
    newest_ = std::move(all);
  }
  news_.notify_one();
}

void SignInFile::write_newest() {
  std::unique_lock lock(mutex_);
  while (true) {
    news_.wait(lock, [this] { return newest_ || ending_; });
    if (!newest_) return;
    const std::vector<SignIn> all = std::move(*newest_);
    newest_.reset();
    lock.unlock();
    try {
      write_atomically(file_, text_of(all), Readers::kOwner);
    } catch (const std::exception& error) {
      spdlog::warn("sign-ins end with this daemon: {}", error.what());
    }
    lock.lock();
  }
}

}  // namespace cellcal::daemon
