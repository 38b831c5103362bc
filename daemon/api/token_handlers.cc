// Login, logout and management of tokens.

#include "calib/files/json.h"
#include "daemon/api/access.h"
#include "daemon/api/handlers.h"
#include "daemon/api/http/http.h"
#include "daemon/runner/backend.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

struct TokenRequest {
  std::string name;
  Role role = Role::kNone;
};

TokenRequest token_request(const std::string& body) {
  const json object = calib::parse_json(body);
  const auto has_text = [&](const char* key) {
    return object.contains(key) && object[key].is_string();
  };
  if (!object.is_object() || object.size() != 2 || !has_text("name") || !has_text("role")) {
    throw BadRequest("the body must be {\"name\": \"...\", \"role\": \"...\"}");
  }
  const auto role = parse_role(object["role"].get<std::string>());
  if (!role) throw BadRequest("\"role\" must be \"look\", \"operate\" or \"administer\"");
  const std::string name = object["name"].get<std::string>();
  if (!is_token_name(name)) {
    throw BadRequest("\"name\" must have 1 to 64 letters, digits, '.', '_' or '-'");
  }
  return {name, *role};
}

json to_json(const Token& token) {
  return {{"name", token.name}, {"role", to_string(token.role)}, {"created", token.created}};
}

Answer log_in(Api& api, const Call& call) {
  if (!call.request.is_from_network()) {
    return error(409, "no login is needed over the Unix socket");
  }
  return access_of(api).log_in(call.request);
}

Answer log_out(Api& api, const Call& call) {
  if (!call.request.is_from_network()) return Response{.body = "{}"};
  return access_of(api).log_out(call.request);
}

Answer tokens(Api& api, const Call&) {
  if (const std::string& problem = access_of(api).tokens().problem(); !problem.empty()) {
    throw TokenError(problem);
  }
  json list = json::array();
  for (const Token& token : access_of(api).tokens().list()) list.push_back(to_json(token));
  return Response{.body = dump(list)};
}

Answer add_token(Api& api, const Call& call) {
  const TokenRequest wanted = token_request(call.request.body);
  const std::string token = access_of(api).tokens().add(wanted.name, wanted.role, wall_clock_utc());
  return Response{
      201, "application/json",
      dump({{"name", wanted.name}, {"role", to_string(wanted.role)}, {"token", token}})};
}

Answer remove_token(Api& api, const Call& call) {
  if (!access_of(api).tokens().remove(std::string(call.variable))) {
    throw NotFound("no such token. See 'cellcal token list'");
  }
  access_of(api).clearance().forget();  // the confirmation may have been given with this token
  return Response{.body = "{}"};
}

}  // namespace

std::span<const Api::Route> token_routes() {
  static constexpr Api::Route kRoutes[] = {
      {"POST", "/v1/login", Role::kNone, kAtOnce, log_in},
      {"POST", "/v1/logout", Role::kNone, kAtOnce, log_out},
      {"GET", "/v1/tokens", Role::kAdminister, kSlow, tokens},
      {"POST", "/v1/tokens", Role::kAdminister, kSlow, add_token},
      {"DELETE", "/v1/tokens/{name}", Role::kAdminister, kSlow, remove_token},
  };
  return kRoutes;
}

}  // namespace cellcal::daemon
