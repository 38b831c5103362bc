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

}  // namespace

std::optional<Response> Api::log_in(const Call& call) {
  if (!call.request.is_from_network()) {
    return error(409, "no login is needed over the Unix socket");
  }
  return access().log_in(call.request);
}

std::optional<Response> Api::log_out(const Call& call) {
  if (!call.request.is_from_network()) return Response{.body = "{}"};
  return access().log_out(call.request);
}

std::optional<Response> Api::tokens(const Call&) {
  if (const std::string& problem = access().tokens().problem(); !problem.empty()) {
    throw TokenError(problem);
  }
  json list = json::array();
  for (const Token& token : access().tokens().list()) list.push_back(to_json(token));
  return Response{.body = dump(list)};
}

std::optional<Response> Api::add_token(const Call& call) {
  const TokenRequest wanted = token_request(call.request.body);
  const std::string token = access().tokens().add(wanted.name, wanted.role, wall_clock_utc());
  return Response{
      201, "application/json",
      dump({{"name", wanted.name}, {"role", to_string(wanted.role)}, {"token", token}})};
}

std::optional<Response> Api::remove_token(const Call& call) {
  if (!access().tokens().remove(std::string(call.variable))) {
    throw NotFound("no such token. See 'cellcal token list'");
  }
  access().clearance().forget();  // the confirmation may have been given with this token
  return Response{.body = "{}"};
}

}  // namespace cellcal::daemon
