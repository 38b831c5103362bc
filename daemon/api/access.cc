#include "daemon/api/access.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <bit>
#include <utility>

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
  const json object = json::parse(body, nullptr, false);
  const bool sound = object.is_object() && object.size() == 1 && object.contains("token") &&
                     object["token"].is_string();
  if (!sound) throw BadRequest("the body must be {\"token\": \"...\"}");
  return object["token"].get<std::string>();
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
  if (needed == Role::kNobody) return std::nullopt;
  const bool bearer = !request.header("authorization").empty();
  if (!bearer && cookie_of(request).empty()) {
    Response none = error(401,
                          "a token is needed: 'cellcal token add' on the cell's computer makes "
                          "one. Send it as 'Authorization: Bearer TOKEN', or log in with it");
    none.headers = {{"WWW-Authenticate", "Bearer"}};
    return none;
  }
  const std::optional<Token> token = token_of(request);
  if (!token) return wrong_token(request);
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
  gone.headers = {{"Set-Cookie", fmt::format("{}=; Path=/; Max-Age=0; HttpOnly; SameSite=Strict{}",
                                             cookie_name(), config_.tls ? "; Secure" : "")}};
  return gone;
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

namespace {

constexpr std::chrono::minutes kForgotten{10};
constexpr std::chrono::milliseconds kFirstWait{100}, kLongestWait{5'000};
constexpr int kMostDoublings = 6;
constexpr std::size_t kMostAddresses = 1000;

}  // namespace

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

void Clearance::look(const Status& status) {
  // kIdle and kDone leave the confirmation unchanged; kDone never occurs without a session under way.
  if (status.phase != Phase::kIdle && status.phase != Phase::kDone) forget();
}

}  // namespace cellcal::daemon
