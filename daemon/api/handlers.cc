#include "daemon/api/handlers.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <charconv>
#include <limits>
#include <nlohmann/json.hpp>

#include "calib/files/calibration_json.h"
#include "calib/files/json.h"
#include "calib/model/error.h"
#include "daemon/api/access.h"
#include "daemon/cell_form/cell_form.h"
#include "daemon/files/atomic_file.h"
#include "daemon/tasks/active_calibration.h"
#include "drivers/error.h"

namespace cellcal::daemon {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::size_t kLongestName = 100;

EventFeed::Source source(SessionService& service) {
  return {[&service] { return service.status(); },
          [&service](std::uint64_t seq) { return service.since(seq); }};
}

void refuse_while_under_way(const Status& status) {
  if (!kActivePhases.has(status.phase) && status.phase != Phase::kStopping) return;
  throw BusyError("session " + std::to_string(status.session) +
                  " is running. Wait for its end, or abort it");
}

template <class T>
void read(const json& value, const char* key, T& field) {
  bool fits = value.is_string();
  if constexpr (std::is_same_v<T, bool>)
    fits = value.is_boolean();
  else if constexpr (std::is_same_v<T, double>)
    fits = value.is_number();
  else if constexpr (std::is_integral_v<T>)
    fits =
        value.is_number_unsigned() && value.get<std::uint64_t>() <= std::numeric_limits<int>::max();
  if (!fits) throw BadRequest(fmt::format("\"{}\" has the wrong type or range", key));
  value.get_to(field);
}

template <class T>
void read(const json& value, const char* key, std::optional<T>& field) {
  read(value, key, field.emplace());
}

void read(const json& value, const char* key, SessionKind& kind) {
  std::string name;
  read(value, key, name);
  const auto known = session_kind(name);
  if (!known)
    throw BadRequest(
        "\"kind\" must be \"calibrate\", \"qualify\", \"find\", \"dry-run\" or \"check\"");
  kind = *known;
}

void read(const json& value, const char* key, std::vector<std::string>& names) {
  constexpr std::size_t kMostNames = 20;
  const auto is_name = [](const json& one) {
    return one.is_string() && printable(one.get<std::string>()) == one.get<std::string>();
  };
  if (!value.is_array() || value.empty() || value.size() > kMostNames ||
      !std::ranges::all_of(value, is_name))
    throw BadRequest(fmt::format("\"{}\" must be a list of 1 to {} names", key, kMostNames));
  value.get_to(names);
}

bool is_link(const fs::path& path) {
  std::error_code none;
  return fs::is_symlink(path, none);
}

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

Answer health(Api&, const Call&) {
  return Response{.body = dump({{"ok", true}, {"version", calib::software_version()}})};
}

Answer me(Api&, const Call& call) {
  const Caller& caller = call.request.caller;
  return Response{.body = dump({{"role", to_string(caller.role)}, {"name", caller.name}})};
}

Answer status(Api& api, const Call& call) {
  return Response{.body = status_to_json(api.service.status(), language_in(call.request))};
}

Answer watch(Api& api, const Call& call) {
  const std::int64_t since = whole_number_in(call.request, "since").value_or(0);
  std::string lines;
  for (const Status& one : api.service.since(static_cast<std::uint64_t>(since))) {
    lines += status_to_json(one) + "\n";
  }
  if (lines.empty() && !call.give_up) return std::nullopt;
  return Response{200, "application/x-ndjson", std::move(lines)};
}

Answer events(Api& api, const Call& call) {
  const Request& request = call.request;
  // The id that a browser sends on reconnection is newer than the one in its address.
  std::string since = request.header("last-event-id");
  if (const auto given = request.query.find("since"); since.empty() && given != request.query.end())
    since = given->second;
  std::optional<EventId> id;
  if (!since.empty()) {
    id = parse_event_id(since);
    if (!id) throw BadRequest("\"since\" must be the id of an event, such as 57 or 57.1");
  }
  Response response{200, "text/event-stream"};
  response.stream = (request.is_from_network() ? api.network_feed : api.local_feed).follow(id);
  if (request.is_from_network())
    response.stream = access_of(api).while_admitted(request, response.stream);
  return response;
}

Answer run(Api& api, const Call& call) {
  const RunRequest wanted = run_request(call.request.body);
  keep_among_cells(api, call.request, wanted.cell);
  return with_clear_cell(api, call, [&] {
    return Response{201, "application/json", dump({{"session", api.service.start(wanted)}})};
  });
}

Answer clear(Api& api, const Call& call) {
  refuse_while_under_way(api.service.status());
  access_of(api).clearance().acknowledge(call.request.caller.name);
  return Response{.body = dump({{"valid_s", kClearanceLasts.count()}})};
}

Answer abort(Api& api, const Call&) {
  if (!api.abort_session()) return error(409, "no session is running");
  return Response{202, "application/json", dump({{"session", api.service.status().session}})};
}

}  // namespace

Api::Api(SessionService& service, Journal& journal, Access* access, Page page, Examiner* examiner)
    : service(service),
      journal(journal),
      access(access),
      page(std::move(page)),
      examiner(examiner),
      drift_watch(journal),
      local_feed(source(service)),
      network_feed(source(service)) {}

std::optional<Response> Api::admit_local(Request& request) const {
  request.caller = {Role::kAdminister, kLocalName};
  return std::nullopt;
}

std::optional<Response> Api::admit_network(Request& request) const {
  const Match found = match(request);
  const bool is_page = found.route == nullptr && !request.path.starts_with("/v1/");
  const Role needed = found.route != nullptr ? found.route->role
                      : is_page              ? Role::kNone
                                             : Role::kView;
  if (access != nullptr) return access->admit(request, needed);
  if (needed == Role::kNone) return std::nullopt;
  return error(401, "a token is needed, and this daemon has none");
}

std::optional<Response> Api::answer(const Request& request, bool give_up) try {
  const Match found = match(request);
  if (found.route == nullptr && found.path_known) {
    return error(405, "wrong method for " + request.path);
  }
  if (found.route == nullptr) {
    if (page && request.method == "GET" && !request.path.starts_with("/v1/")) {
      if (auto answer = page(request)) return answer;
    }
    return error(404, "no such resource: " + request.path);
  }
  // Already checked on admission; repeated for safety.
  if (request.caller.role < found.route->role) {
    return error(403, std::string("the role ") + to_string(found.route->role) + " is needed");
  }
  return found.route->answer(*this, {request, found.variable, give_up});
} catch (const BadRequest& bad) {
  return error(400, bad.what());
} catch (const NotFound& none) {
  return error(404, none.what());
} catch (const BusyError& busy) {
  return error(409, busy.what());
} catch (const TokenError& wrong) {
  return error(409, wrong.what());
} catch (const FieldError& wrong) {
  json body{{"error", wrong.what()}};
  if (!wrong.key.empty()) body.update({{"key", wrong.key}, {"reason", wrong.reason}});
  return Response{422, "application/json", dump(body)};
} catch (const RequestError& wrong) {
  return error(422, wrong.what());
} catch (const NotUsable& refused) {
  return error(refused.why == NotUsable::Why::kNoSession ? 404 : 422, refused.what());
} catch (const calib::FileError& wrong) {
  return error(422, wrong.what());
} catch (const calib::LinearUnitError& wrong) {
  return error(422, wrong.what());
} catch (const calib::PositionerError& wrong) {
  return error(422, wrong.what());
} catch (const drivers::ConfigError& wrong) {
  return error(422, wrong.what());
} catch (const std::exception& failed) {
  spdlog::error("{} {}: {}", request.method, request.path, failed.what());
  return error(500, system_words(failed));
}

Access& access_of(const Api& api) {
  if (api.access == nullptr) throw NotFound("this daemon has no tokens");
  return *api.access;
}

Answer with_clear_cell(Api& api, const Call& call, const std::function<Response()>& act) {
  const bool afar = call.request.is_from_network();
  const std::string& name = call.request.caller.name;
  if (afar && !access_of(api).clearance().take(name)) {
    refuse_while_under_way(api.service.status());
    return error(
        412,
        "the cell is not confirmed as clear. Check that no person and nothing is in it, then "
        "confirm: 'The cell is clear' on the page, or POST /v1/clear. It counts for 5 minutes and "
        "one request");
  }
  try {
    return act();
  } catch (...) {
    if (afar) access_of(api).clearance().put_back(name);
    throw;
  }
}

void keep_among_cells(const Api& api, const Request& request, const std::filesystem::path& cell) {
  if (cell.empty()) return;
  NetworkFiles cells{
      "a cell file",
      "Place it there, name its folder in cell_folders of [http], or use 'cellcal' on "
      "the cell's computer",
      api.cell_folders};
  if (api.shelf != nullptr) cells.folders.push_back(api.shelf->folder());
  keep_within(request, cell, cells);
  if (request.is_from_network() && cell.extension() != ".toml")
    throw RequestError("over the network a cell file's name must end in .toml");
}

bool Api::abort_session() {
  if (access != nullptr) access->clearance().forget();
  return service.abort();
}

json object_in(const std::string& body, std::initializer_list<const char*> known) {
  json object = calib::parse_json(body);
  if (!object.is_object()) throw BadRequest("the body must be a JSON object");
  for (const auto& [key, value] : object.items())
    if (known.size() > 0 && std::find(known.begin(), known.end(), key) == known.end())
      throw BadRequest("\"" + printable(key) + "\" is not known here");
  return object;
}

RunRequest run_request(const std::string& body) {
  json object = object_in(body);
  RunRequest request;
  each_run_key(request, [&](const char* key, auto& field) {
    if (!object.contains(key)) return;
    read(object[key], key, field);
    object.erase(key);
  });
  if (!object.empty()) throw BadRequest("unknown key \"" + object.begin().key() + "\"");
  if (request.cell.empty() && !request.resume && request.kind != SessionKind::kCheck)
    throw BadRequest("\"cell\" is missing");
  for (const std::string& text :
       {request.cell.string(), request.target, request.load, request.region})
    if (printable(text) != text)
      throw BadRequest(
          "\"cell\", \"target\", \"load\" and \"region\" must not contain control characters");
  return request;
}

std::string line_in(const nlohmann::json& body, const char* key, std::size_t longest) {
  const std::string text =
      body.contains(key) && body[key].is_string() ? body[key].get<std::string>() : "";
  if (text.find_first_not_of(' ') == std::string::npos || text.size() > longest ||
      printable(text) != text)
    throw BadRequest(fmt::format(
        "\"{}\" must be a text of 1 to {} bytes without control characters", key, longest));
  return text;
}

std::string author_of(const Request& request, const nlohmann::json& body) {
  if (!body.contains("by")) return request.caller.name;
  return fmt::format("{} ({})", line_in(body, "by", kLongestName), request.caller.name);
}

void keep_within(const Request& request, const fs::path& file, const NetworkFiles& allowed) {
  if (!request.is_from_network()) return;
  std::string places;
  for (const fs::path& one : allowed.folders) {
    const fs::path folder = fs::absolute(one / "").lexically_normal().parent_path();
    const bool directly =
        file.has_filename() && file.parent_path() == folder && file.lexically_normal() == file;
    if (directly && !is_link(folder) && !is_link(file)) return;
    places += (places.empty() ? "" : " or ") + folder.string();
  }
  throw RequestError(
      fmt::format("over the network {} must lie directly in {} and must not be a link. {}",
                  allowed.what, places, allowed.instead));
}

const std::vector<Api::Route>& Api::routes() {
  static constexpr Route kOwn[] = {
      {"GET", "/v1/health", Role::kNone, kAtOnce, health},
      {"GET", "/v1/me", Role::kView, kAtOnce, me},
      {"GET", "/metrics", Role::kView, kSlow, metrics},
      {"GET", "/v1/status", Role::kView, kAtOnce, status},
      {"GET", "/v1/watch", Role::kView, kAtOnce, watch},
      {"GET", "/v1/events", Role::kView, kAtOnce, events},
      {"POST", "/v1/run", Role::kOperate, kSlow, run},
      {"POST", "/v1/abort", Role::kOperate, kAtOnce, abort},
      {"POST", "/v1/clear", Role::kOperate, kAtOnce, clear},
  };
  static const std::vector<Route> kAll = [] {
    std::vector<Route> all(std::begin(kOwn), std::end(kOwn));
    for (const auto& some : {token_routes(), session_routes(), drawing_routes(), version_routes(),
                             plant_routes(), frame_routes(), cell_form_routes()})
      all.insert(all.end(), some.begin(), some.end());
    return all;
  }();
  return kAll;
}

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

calib::Language language_in(const Request& request) {
  const auto given = request.query.find("language");
  if (given == request.query.end()) return {};
  const auto language = calib::Language::of(given->second);
  if (!language)
    throw BadRequest(
        fmt::format("\"language\" must be one of {}", fmt::join(calib::Language::codes(), ", ")));
  return *language;
}

bool Api::is_slow(const Request& request) {
  const Match found = match(request);
  return found.route != nullptr && found.route->slow;
}

}  // namespace cellcal::daemon
