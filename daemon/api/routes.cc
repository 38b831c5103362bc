#include "daemon/api/routes.h"

#include <charconv>

#include "daemon/api/run_request.h"

namespace cellcal::daemon {

std::span<const Api::Route> Api::routes() {
  constexpr bool kSlow = true, kAtOnce = false;
  // clang-format off
  static constexpr Route kRoutes[] = {
      {"GET",  "/v1/health",                         Role::kNobody,  kAtOnce, &Api::health},
      {"POST", "/v1/login",                          Role::kNobody,  kAtOnce, &Api::log_in},
      {"POST", "/v1/logout",                         Role::kNobody,  kAtOnce, &Api::log_out},
      {"GET",  "/v1/me",                             Role::kLook,    kAtOnce, &Api::me},
      {"GET",  "/metrics",                           Role::kLook,    kSlow,   &Api::metrics},
      {"GET",  "/v1/status",                         Role::kLook,    kAtOnce, &Api::status},
      {"GET",  "/v1/watch",                          Role::kLook,    kAtOnce, &Api::watch},
      {"GET",  "/v1/events",                         Role::kLook,    kAtOnce, &Api::events},
      {"POST", "/v1/run",                            Role::kOperate, kSlow,   &Api::run},
      {"POST", "/v1/abort",                          Role::kOperate, kAtOnce, &Api::abort},
      {"POST", "/v1/clear",                          Role::kOperate, kAtOnce, &Api::clear},
      {"GET",  "/v1/schedule",                       Role::kLook,    kSlow,   &Api::show_schedule},
      {"POST", "/v1/schedule/begin",                 Role::kOperate, kSlow,   &Api::begin_scheduled},
      {"POST", "/v1/schedule/release",               Role::kOperate, kSlow,   &Api::release_schedule},
      {"GET",  "/v1/tokens",                         Role::kAdminister, kSlow, &Api::tokens},
      {"POST", "/v1/tokens",                         Role::kAdminister, kSlow, &Api::add_token},
      {"DELETE", "/v1/tokens/{name}",                Role::kAdminister, kSlow, &Api::remove_token},
      {"GET",  "/v1/sessions",                       Role::kLook,    kSlow,   &Api::sessions},
      {"GET",  "/v1/sessions/{id}",                  Role::kLook,    kSlow,   &Api::session},
      {"GET",  "/v1/sessions/{id}/touches",          Role::kLook,    kSlow,   &Api::session_touches},
      {"GET",  "/v1/sessions/{id}/events",           Role::kLook,    kSlow,   &Api::session_events},
      {"GET",  "/v1/sessions/{id}/plan",             Role::kLook,    kSlow,   &Api::plan},
      {"GET",  "/v1/sessions/{id}/figures",          Role::kLook,    kSlow,   &Api::figures},
      {"GET",  "/v1/scene",                          Role::kLook,    kSlow,   &Api::scene},
      {"GET",  "/v1/drift",                          Role::kLook,    kSlow,   &Api::drift},
      {"GET",  "/v1/readiness",                      Role::kLook,    kSlow,   &Api::readiness},
      {"GET",  "/v1/doctor",                         Role::kLook,    kAtOnce, &Api::doctor},
      {"POST", "/v1/doctor",                         Role::kOperate, kSlow,   &Api::examine},
      {"POST", "/v1/doctor/result",                  Role::kOperate, kSlow,   &Api::adopt_examination},
      {"GET",  "/v1/cell-form",                      Role::kOperate, kSlow,   &Api::show_cell_form},
      {"POST", "/v1/cell-form",                      Role::kOperate, kSlow,   &Api::write_cell},
      {"POST", "/v1/cell-form/lists",                Role::kOperate, kSlow,   &Api::read_cell_lists},
      {"GET",  "/v1/sessions/{id}/touches.csv",      Role::kLook,    kSlow,   &Api::touches_csv},
      {"GET",  "/v1/sessions/{id}/calibration.json", Role::kLook,    kSlow,   &Api::calibration},
      {"GET",  "/v1/sessions/{id}/found.json", Role::kLook,  kSlow,   &Api::found},
      {"GET",  "/v1/sessions/{id}/qualification.json", Role::kLook,  kSlow,   &Api::qualification},
      {"GET",  "/v1/sessions/{id}/check.json",       Role::kLook,    kSlow,   &Api::check},
      {"GET",  "/v1/sessions/{id}/report.html",      Role::kLook,    kSlow,   &Api::report},
      {"GET",  "/v1/sessions/{id}/export",           Role::kLook,    kSlow,   &Api::export_session},
      {"POST", "/v1/sessions/{id}/certificate",      Role::kOperate, kSlow,   &Api::report_certificate},
      {"GET",  "/v1/versions",                       Role::kLook,    kSlow,   &Api::show_versions},
      {"GET",  "/v1/versions/compare",               Role::kLook,    kSlow,   &Api::compare_versions},
      {"POST", "/v1/versions/activate",              Role::kOperate, kSlow,   &Api::activate_version},
      {"POST", "/v1/versions/roll-back",             Role::kOperate, kSlow,   &Api::roll_back_version},
      {"POST", "/v1/position",                       Role::kOperate, kSlow,   &Api::read_position},
      {"GET",  "/v1/frames",                         Role::kLook,    kSlow,   &Api::show_frames},
      {"POST", "/v1/frames",                         Role::kAdminister, kSlow, &Api::set_frame},
      {"POST", "/v1/frames/read",                    Role::kAdminister, kSlow, &Api::read_frame},
      {"POST", "/v1/frames/restore",                 Role::kAdminister, kSlow, &Api::restore_frame},
      {"GET",  "/v1/plant",                          Role::kLook,    kSlow,   &Api::show_plant},
      {"GET",  "/v1/proposals",                      Role::kLook,    kSlow,   &Api::show_proposals},
      {"POST", "/v1/proposals/{id}/accept",          Role::kOperate, kSlow,   &Api::accept_proposal},
      {"POST", "/v1/proposals/{id}/refuse",          Role::kOperate, kSlow,   &Api::refuse_proposal},
      {"POST", "/v1/import",                         Role::kAdminister, kSlow, &Api::import_session},
      {"POST", "/v1/backup",                         Role::kAdminister, kSlow, &Api::back_up},
      {"POST", "/v1/retain",                         Role::kAdminister, kSlow, &Api::retain},
  };
  // clang-format on
  return kRoutes;
}

namespace {

/// Value of the pattern's segment in braces; none where the path does not match.
std::optional<std::string_view> fits(std::string_view pattern, std::string_view path) {
  const std::size_t open = pattern.find('{');
  if (open == std::string_view::npos) {
    return pattern == path ? std::optional(std::string_view()) : std::nullopt;
  }
  const std::string_view before = pattern.substr(0, open);
  const std::string_view behind = pattern.substr(pattern.find('}') + 1);
  if (!path.starts_with(before)) return std::nullopt;
  path.remove_prefix(before.size());
  const std::string_view variable = path.substr(0, path.find('/'));
  if (variable.empty() || path.substr(variable.size()) != behind) return std::nullopt;
  return variable;
}

}  // namespace

Match match(const Request& request) {
  Match found;
  for (const Api::Route& route : Api::routes()) {
    const auto variable = fits(route.path, request.path);
    if (!variable) continue;
    found.path_known = true;
    if (request.method != route.method) continue;
    found.route = &route;
    found.variable = *variable;
    return found;
  }
  return found;
}

std::optional<std::int64_t> whole_number(std::string_view text) {
  std::int64_t value = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || end != text.data() + text.size() || value < 0) return std::nullopt;
  return value;
}

std::optional<std::int64_t> whole_number_in(const Request& request, const char* key) {
  const auto given = request.query.find(key);
  if (given == request.query.end()) return std::nullopt;
  const auto number = whole_number(given->second);
  if (!number) throw BadRequest(std::string("\"") + key + "\" must be a whole number");
  return number;
}

bool Api::is_slow(const Request& request) {
  const Match found = match(request);
  return found.route != nullptr && found.route->slow;
}

}  // namespace cellcal::daemon
