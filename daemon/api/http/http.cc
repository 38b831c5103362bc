#include "daemon/api/http/http.h"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <charconv>
#include <cmath>

#include "calib/files/text.h"
#include "calib/model/enum_table.h"

namespace cellcal::daemon {

namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using Local = asio::local::stream_protocol;

/// Reports and calibrations of hundreds of touches are a few megabytes.
constexpr std::uint64_t kMostAnswer = 256u << 20;
/// sun_path holds 108 bytes including the terminator.
constexpr std::size_t kLongestPath = 107;

bool is_port(std::string_view text) {
  constexpr std::size_t kDigits = 5;
  return !text.empty() && text.size() <= kDigits &&
         text.find_first_not_of("0123456789") == std::string_view::npos;
}

bool is_address(int family, const std::string& text) {
  in6_addr any{};
  return ::inet_pton(family, text.c_str(), &any) == 1;
}

/// Decodes %XX (RFC 3986, 2.1); any other % is kept.
std::string decoded(const std::string& text) {
  std::string bytes;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const char* const digits = text.data() + at + 1;
    unsigned char byte = 0;
    const bool escaped = text[at] == '%' && at + 2 < text.size() &&
                         std::from_chars(digits, digits + 2, byte, 16).ptr == digits + 2;
    bytes += escaped ? static_cast<char>(byte) : text[at];
    if (escaped) at += 2;
  }
  return bytes;
}

std::string escaped(const std::string& words) {
  std::string text;
  for (const char c : words) {
    if (c == '\n') {
      text += "\\n";
      continue;
    }
    if (c == '\\' || c == '"') text += '\\';
    text += c;
  }
  return text;
}

}  // namespace

void require_socket_path(const std::filesystem::path& socket) {
  if (socket.empty() || socket.string().size() > kLongestPath) {
    throw ClientSocketError({"say.socket.path", {{"socket", socket.string()}}});
  }
}

Response http_request(const std::filesystem::path& socket, const std::string& method,
                      const std::string& target, const std::string& body,
                      std::chrono::milliseconds most) {
  asio::io_context context;
  beast::basic_stream<Local> peer(context);
  require_socket_path(socket);
  beast::error_code code;
  peer.socket().connect(socket.string(), code);
  if (code == asio::error::access_denied) {
    throw SocketPermissionError({"say.socket.permission", {{"socket", socket.string()}}});
  }
  if (code) {
    throw ClientSocketError(
        {"say.socket.closed", {{"socket", socket.string()}, {"why", code.message()}}});
  }
  http::request<http::string_body> request(http::string_to_verb(method), target, 11);
  request.set(http::field::host, "cellcald");
  request.set(http::field::content_type, "application/json");
  request.keep_alive(false);
  request.body() = body;
  request.prepare_payload();
  beast::flat_buffer buffer;
  http::response_parser<http::string_body> parser;
  parser.body_limit(kMostAnswer);
  if (most.count() > 0) peer.expires_after(most);
  http::async_write(peer, request, [&](beast::error_code failed, std::size_t) {
    code = failed;
    if (code) return;
    http::async_read(peer, buffer, parser,
                     [&](beast::error_code unread, std::size_t) { code = unread; });
  });
  context.run();
  if (code) {
    throw ClientSocketError(
        {"say.socket.silent", {{"socket", socket.string()}, {"why", code.message()}}});
  }
  auto message = parser.release();
  return {static_cast<int>(message.result_int()), std::string(message[http::field::content_type]),
          std::move(message.body())};
}

bool host_is_ours(const Request& request, const std::vector<std::string>& names) {
  std::string host = calib::lower_case(request.header("host"));
  const std::size_t colon = host.rfind(':');
  if (colon != std::string::npos && is_port(std::string_view(host).substr(colon + 1))) {
    host.resize(colon);
  }
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
    return is_address(AF_INET6, host.substr(1, host.size() - 2));
  }
  return host == "localhost" || is_address(AF_INET, host) ||
         std::find(names.begin(), names.end(), host) != names.end();
}

bool origin_is_ours(const Request& request, bool tls) {
  const std::string origin = calib::lower_case(request.header("origin"));
  if (origin.empty()) return !request.headers.contains("origin");
  const std::string host = calib::lower_case(request.header("host"));
  return origin == "https://" + host || (!tls && origin == "http://" + host);
}

std::string network_of(const std::string& address) {
  const std::size_t scope = std::min(address.find('%'), address.size());
  in6_addr bytes{};
  if (::inet_pton(AF_INET6, address.substr(0, scope).c_str(), &bytes) != 1) return address;
  // Otherwise all of IPv4 would count as one network.
  if (IN6_IS_ADDR_V4MAPPED(&bytes)) return address;
  constexpr std::size_t kNetworkBytes = 8;
  return std::string(reinterpret_cast<const char*>(bytes.s6_addr), kNetworkBytes) +
         address.substr(scope);
}

const std::string& Request::header(const std::string& name) const {
  static const std::string kNone;
  const auto found = headers.find(name);
  return found == headers.end() ? kNone : found->second;
}

Request parse_target(const std::string& method, const std::string& target, std::string body) {
  Request request{method, target, {}, std::move(body)};
  const std::size_t mark = target.find('?');
  if (mark == std::string::npos) return request;
  request.path = target.substr(0, mark);
  std::size_t at = mark + 1;
  while (at < target.size()) {
    const std::size_t end = std::min(target.find('&', at), target.size());
    const std::string pair = target.substr(at, end - at);
    const std::size_t equals = std::min(pair.find('='), pair.size());
    request.query.emplace(pair.substr(0, equals),
                          equals < pair.size() ? decoded(pair.substr(equals + 1)) : "");
    at = end + 1;
  }
  return request;
}

Response error(int status, const std::string& words) {
  // Foreign text may hold any bytes: invalid UTF-8 is replaced instead of throwing.
  return {status, "application/json",
          nlohmann::json{{"error", words}}.dump(-1, ' ', false,
                                                nlohmann::json::error_handler_t::replace)};
}

Response busy(const std::string& words) {
  Response response = error(503, words);
  response.headers = {{"Retry-After", "5"}};
  return response;
}

const char* to_string(Role role) {
  using enum Role;
  static constexpr EnumNames<Role> kTable{
      {{kNone, "nobody"}, {kView, "look"}, {kOperate, "operate"}, {kAdminister, "administer"}}};
  return kTable[role];
}

std::optional<Role> parse_role(std::string_view word) {
  for (const Role role : {Role::kView, Role::kOperate, Role::kAdminister}) {
    if (word == to_string(role)) return role;
  }
  return std::nullopt;
}

void Exposition::family(const char* name, const char* type, const char* help) {
  family_ = name;
  text_ += fmt::format("# HELP {0} {2}\n# TYPE {0} {1}\n", name, type, help);
}

void Exposition::sample(double value, const Labels& labels, const char* suffix) {
  text_ += family_ + suffix;
  const char* separator = "{";
  for (const auto& [name, words] : labels) {
    text_ += fmt::format("{}{}=\"{}\"", separator, name, escaped(words));
    separator = ",";
  }
  text_ += (labels.empty() ? " " : "} ") + number(value) + "\n";
}

std::string Exposition::number(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0.0 ? "+Inf" : "-Inf";
  return fmt::format("{}", value);
}

}  // namespace cellcal::daemon
