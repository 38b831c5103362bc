#include "daemon/api/http/message.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "calib/model/enum_table.h"

namespace cellcal::daemon {

const std::string& Request::header(const std::string& name) const {
  static const std::string kNone;
  const auto found = headers.find(name);
  return found == headers.end() ? kNone : found->second;
}

namespace {

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

/// Decodes %XX (RFC 3986, 2.1); any other % is kept.
std::string decoded(const std::string& text) {
  std::string bytes;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const bool escaped = text[at] == '%' && at + 2 < text.size();
    const int high = escaped ? hex_digit(text[at + 1]) : -1;
    const int low = escaped ? hex_digit(text[at + 2]) : -1;
    const bool is_byte = high >= 0 && low >= 0;
    bytes += is_byte ? static_cast<char>(16 * high + low) : text[at];
    if (is_byte) at += 2;
  }
  return bytes;
}

}  // namespace

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
      {{kNobody, "nobody"}, {kLook, "look"}, {kOperate, "operate"}, {kAdminister, "administer"}}};
  return kTable[role];
}

std::optional<Role> parse_role(std::string_view word) {
  for (const Role role : {Role::kLook, Role::kOperate, Role::kAdminister}) {
    if (word == to_string(role)) return role;
  }
  return std::nullopt;
}

}  // namespace cellcal::daemon
