#include "daemon/api/access.h"

#include <fmt/format.h>
#include <openssl/crypto.h>
#include <openssl/rand.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <algorithm>
#include <bit>
#include <boost/algorithm/hex.hpp>
#include <nlohmann/json.hpp>
#include <set>

#include "calib/files/input_file.h"
#include "calib/files/json.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

constexpr std::string_view kBearer = "Bearer ";
constexpr std::size_t kMostShown = 80;

bool changes_something(const Request& request) {
  return request.method != "GET" && request.method != "HEAD";
}

/// Printable form of foreign text, for use within a message.
std::string shown(const std::string& text) { return printable(text).substr(0, kMostShown); }

Response who(const Token& token) {
  return Response{.body = dump({{"role", to_string(token.role)}, {"name", token.name}})};
}

std::string token_in(const std::string& body) {
  const json object = calib::parse_json(body);
  const bool sound = object.is_object() && object.size() == 1 && object.contains("token") &&
                     object["token"].is_string();
  if (!sound) throw BadRequest("the body must be {\"token\": \"...\"}");
  return object["token"].get<std::string>();
}

constexpr std::chrono::minutes kForgotten{10};
constexpr std::chrono::milliseconds kFirstWait{100}, kLongestWait{5'000};
constexpr int kMostDoublings = 6;
constexpr std::size_t kMostAddresses = 1000;

using nlohmann::json;

constexpr const char* kFormat = "cellcal.tokens/1";
constexpr std::size_t kMostTokens = 1000, kMostBytes = 1u << 20;
constexpr std::size_t kLongestTokenName = 64;

/// Text of the key; throws where it is missing or not a string.
std::string token_field(const json& object, const char* key) {
  return object.at(key).get<std::string>();
}

Token token_of(const json& value) {
  Token token{token_field(value, "name"), Role::kNone, token_field(value, "sha256"),
              token_field(value, "created")};
  const auto role = parse_role(token_field(value, "role"));
  const bool sound = role && is_token_name(token.name) && calib::is_sha256(token.sha256);
  constexpr std::size_t kKeys = 4;
  if (!sound || value.size() != kKeys) throw std::runtime_error("a token is malformed");
  token.role = *role;
  return token;
}

/// Throws on any malformed content.
std::vector<Token> parse(const std::string& text) {
  const json document = json::parse(text);
  if (document.size() != 2 || token_field(document, "format") != kFormat) {
    throw std::runtime_error(std::string("format must be \"") + kFormat + "\"");
  }
  const json& list = document.at("tokens");
  if (!list.is_array() || list.size() > kMostTokens) throw std::runtime_error("no list of tokens");
  std::vector<Token> tokens;
  std::set<std::string> names;
  for (const json& value : list) {
    tokens.push_back(token_of(value));
    if (!names.insert(tokens.back().name).second) throw std::runtime_error("a name is given twice");
  }
  return tokens;
}

std::string text_of(const std::vector<Token>& tokens) {
  json list = json::array();
  for (const Token& token : tokens) {
    list.push_back({{"name", token.name},
                    {"role", to_string(token.role)},
                    {"sha256", token.sha256},
                    {"created", token.created}});
  }
  return json{{"format", kFormat}, {"tokens", list}}.dump(1) + "\n";
}

bool is_open_to_others(const std::filesystem::path& path) {
  struct stat info {};
  return ::stat(path.c_str(), &info) == 0 && (info.st_mode & (S_IRWXG | S_IRWXO)) != 0;
}

/// Compares with all tokens, so that the duration reveals nothing.
std::optional<Token> match(const std::vector<Token>& tokens, std::string_view sha256) {
  std::optional<Token> found;
  for (const Token& token : tokens) {
    if (token.sha256.size() == sha256.size() &&
        ::CRYPTO_memcmp(token.sha256.data(), sha256.data(), sha256.size()) == 0) {
      found = token;
    }
  }
  return found;
}

/// Screens and browsers of one token. The number of tokens is small, since only administrators add them.
constexpr std::ptrdiff_t kMostOfOneToken = 32;

bool same(const std::string& a, const std::string& b) {
  return a.size() == b.size() && ::CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

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

class Access::Admitted final : public Stream {
 public:
  Admitted(Access& access, const Request& request, std::shared_ptr<Stream> stream)
      : access_(access), request_(request), stream_(std::move(stream)) {}
  std::optional<std::string> next() override {
    const std::optional<Token> token = access_.token_of(request_);
    if (!token || token->name != request_.caller.name) return std::nullopt;
    return stream_->next();
  }

 private:
  Access& access_;
  Request request_;
  std::shared_ptr<Stream> stream_;
};

std::shared_ptr<Stream> Access::while_admitted(const Request& request,
                                               std::shared_ptr<Stream> stream) {
  return std::make_shared<Admitted>(*this, request, std::move(stream));
}

std::optional<Response> Access::admit(Request& request, Role needed) {
  if (!host_is_ours(request, config_.host_names)) {
    return error(403, "Host \"" + shown(request.header("host")) +
                          "\" is not known as this computer's. Ask by its address, or add the name "
                          "to host_names of [http] in cellcald.toml");
  }
  if (changes_something(request) && !origin_is_ours(request, config_.tls)) {
    return error(403, "the request was sent by a page of " + shown(request.header("origin")) +
                          ", not by this daemon's own. Open this daemon's page instead");
  }
  if (needed == Role::kNone) return std::nullopt;
  const bool bearer = !request.header("authorization").empty();
  if (!bearer && cookie_of(request).empty()) {
    Response none = error(401,
                          "a token is needed: 'cellcal token add' on the cell's computer makes "
                          "one. Send it as 'Authorization: Bearer TOKEN', or log in with it");
    none.headers = {{"WWW-Authenticate", "Bearer"}};
    return none;
  }
  const std::optional<Token> token = token_of(request);
  if (!token) return bearer ? wrong_token(request) : ended_sign_in();
  if (token->role < needed) {
    return error(403, fmt::format("the role {0} is needed, and the token \"{1}\" has {2}. Make one "
                                  "with it: 'cellcal token add --role {0} --name NAME'",
                                  to_string(needed), token->name, to_string(token->role)));
  }
  request.caller = {token->role, token->name};
  return std::nullopt;
}

std::optional<Token> Access::token_of(const Request& request) {
  const std::string& given = request.header("authorization");
  if (given.empty()) return sign_ins_.find(cookie_of(request));
  if (!given.starts_with(kBearer)) return std::nullopt;
  return tokens_.find(std::string_view(given).substr(kBearer.size()));
}

Response Access::wrong_token(const Request& request) {
  const FailedAttempts::Count count = failed_.add(request.peer);
  // Logged at powers of two, so that the log is not flooded.
  if (std::has_single_bit(static_cast<unsigned>(count.so_far))) {
    spdlog::warn("a wrong token from {}, {} so far", request.peer, count.so_far);
  }
  Response wrong = error(401,
                         "this token or login is not known, or has ended. 'cellcal token list' "
                         "shows the tokens; log in again");
  wrong.headers = {{"WWW-Authenticate", "Bearer"}};
  // An abort is of no use for guessing; an immediate answer lets its sender log in, or press the emergency
  // stop.
  if (request.path != "/v1/abort") wrong.hold = count.wait;
  return wrong;
}

/// A page that asks every second with the cookie of a login that has ended: its 256 random bits are no guess to
/// slow down, and a page without an answer shows no form to log in again.
Response Access::ended_sign_in() const {
  Response ended = error(401, "this login has ended: log in again");
  ended.headers = {{"WWW-Authenticate", "Bearer"}, {"Set-Cookie", no_cookie()}};
  return ended;
}

Response Access::log_in(const Request& request) {
  const std::optional<Token> token = tokens_.find(token_in(request.body));
  if (!token) return wrong_token(request);
  Response welcome = who(*token);
  welcome.headers = {
      {"Set-Cookie",
       fmt::format("{}={}; Path=/; Max-Age={}; HttpOnly; SameSite=Strict{}", cookie_name(),
                   sign_ins_.begin(*token), std::chrono::seconds(kLongestUnused).count(),
                   config_.tls ? "; Secure" : "")}};
  return welcome;
}

Response Access::log_out(const Request& request) {
  sign_ins_.end(cookie_of(request));
  Response gone{.body = "{}"};
  gone.headers = {{"Set-Cookie", no_cookie()}};
  return gone;
}

std::string Access::no_cookie() const {
  return fmt::format("{}=; Path=/; Max-Age=0; HttpOnly; SameSite=Strict{}", cookie_name(),
                     config_.tls ? "; Secure" : "");
}

/// Cookies are not separated by port: two daemons on one computer would overwrite each other's.
std::string Access::cookie_name() const { return fmt::format("cellcal-{}", config_.port); }

std::string Access::cookie_of(const Request& request) const {
  const std::string wanted = cookie_name() + "=";
  std::string_view rest = request.header("cookie");
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find(';'), rest.size());
    std::string_view one = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    while (one.starts_with(' ')) one.remove_prefix(1);
    if (one.starts_with(wanted)) return std::string(one.substr(wanted.size()));
  }
  return "";
}

FailedAttempts::Count FailedAttempts::add(const std::string& address) {
  const auto now = clock_();
  std::erase_if(of_, [&](const auto& one) { return now - one.second.last > kForgotten; });
  if (of_.size() >= kMostAddresses) {
    of_.erase(std::min_element(of_.begin(), of_.end(), [](const auto& a, const auto& b) {
      return a.second.last < b.second.last;
    }));
  }
  Of& one = of_[network_of(address)];
  one.last = now;
  one.count = std::min(one.count + 1, 1'000'000);
  const auto wait = kFirstWait * (1 << std::min(one.count - 1, kMostDoublings));
  return {one.count, std::min(wait, kLongestWait)};
}

void Clearance::acknowledge(const std::string& name) {
  const std::lock_guard lock(mutex_);
  taken_.reset();
  acknowledged_ = Acknowledgement{name, clock_() + kClearanceLasts};
}

bool Clearance::take(const std::string& name) {
  const std::lock_guard lock(mutex_);
  if (!acknowledged_ || acknowledged_->name != name || clock_() >= acknowledged_->until)
    return false;
  taken_ = std::exchange(acknowledged_, std::nullopt);
  return true;
}

void Clearance::put_back(const std::string& name) {
  const std::lock_guard lock(mutex_);
  if (taken_ && taken_->name == name && !acknowledged_)
    acknowledged_ = std::exchange(taken_, std::nullopt);
}

void Clearance::forget() {
  const std::lock_guard lock(mutex_);
  acknowledged_.reset();
  taken_.reset();
}

void Clearance::update(const Status& status) {
  // A change of the schedule repeats the phase of a session that has ended.
  const std::pair now{status.session, status.phase};
  if (std::exchange(newest_, now) == now) return;
  // kIdle and kDone leave the confirmation unchanged; kDone never occurs without a session under way.
  if (status.phase != Phase::kIdle && status.phase != Phase::kDone) forget();
}

std::string random_secret() {
  std::string bytes(32, '\0');
  if (::RAND_bytes(reinterpret_cast<unsigned char*>(bytes.data()),
                   static_cast<int>(bytes.size())) != 1) {
    throw std::runtime_error("the system has no random numbers");
  }
  return boost::algorithm::hex_lower(bytes);
}

bool is_token_name(std::string_view name) {
  constexpr const char* kLetters =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-";
  return !name.empty() && name.size() <= kLongestTokenName &&
         name.find_first_not_of(kLetters) == std::string_view::npos;
}

TokenStore::TokenStore(std::filesystem::path file)
    : file_(std::move(file)), tokens_(std::make_shared<const Tokens>()) {
  if (!std::filesystem::exists(file_)) return;
  if (is_open_to_others(file_)) {
    problem_ = file_.string() +
               ": accessible to other users. No token is accepted. Check who changed it, then "
               "'chmod 600' it and restart cellcald";
    return;
  }
  try {
    tokens_ = std::make_shared<const Tokens>(parse(calib::read_file(file_, kMostBytes)));
  } catch (const std::exception& error) {
    problem_ = file_.string() + ": " + system_words(error) +
               ". No token is accepted. Remove the file, restart cellcald and add the tokens again";
  }
}

std::string TokenStore::add(const std::string& name, Role role, const std::string& utc) {
  if (!is_token_name(name)) {
    throw TokenError("the name must have 1 to 64 letters, digits, '.', '_' or '-'");
  }
  if (name == kLocalName)
    throw TokenError("the name \"local\" is reserved for the Unix socket. Choose another");
  const std::lock_guard lock(writing_);
  if (!problem_.empty()) throw TokenError(problem_);
  Tokens next = *tokens();
  if (std::any_of(next.begin(), next.end(), [&](const Token& one) { return one.name == name; })) {
    throw TokenError("a token \"" + name + "\" exists. Choose another name, or 'cellcal " +
                     "token remove " + name + "' first");
  }
  if (next.size() >= kMostTokens) throw TokenError("1000 tokens exist. Remove some first");
  const std::string secret = random_secret();
  next.push_back({name, role, calib::sha256(secret), utc});
  store(std::move(next));
  return secret;
}

bool TokenStore::remove(const std::string& name) {
  const std::lock_guard lock(writing_);
  if (!problem_.empty()) throw TokenError(problem_);
  Tokens next = *tokens();
  if (std::erase_if(next, [&](const Token& one) { return one.name == name; }) == 0) return false;
  store(std::move(next));
  return true;
}

/// Written to disk first, so that a change is still effective after a restart.
void TokenStore::store(Tokens next) {
  write_atomically(file_, text_of(next), Readers::kOwner);
  auto kept = std::make_shared<const Tokens>(std::move(next));
  const std::lock_guard lock(mutex_);
  tokens_ = std::move(kept);
}

std::shared_ptr<const TokenStore::Tokens> TokenStore::tokens() const {
  const std::lock_guard lock(mutex_);
  return tokens_;
}

std::vector<Token> TokenStore::list() const { return *tokens(); }

std::optional<Token> TokenStore::find(std::string_view token) const {
  return match(*tokens(), calib::sha256(token));
}

std::optional<Token> TokenStore::find_by_sha256(std::string_view sha256) const {
  return match(*tokens(), sha256);
}

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
  if (!std::filesystem::exists(file_)) return {};
  try {
    if (is_open_to_others(file_)) throw std::runtime_error("accessible to other users");
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
