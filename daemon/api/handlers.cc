#include "daemon/api/handlers.h"

#include <spdlog/spdlog.h>

#include "calib/files/calibration_json.h"
#include "calib/model/error.h"
#include "daemon/api/access.h"
#include "daemon/api/http/message.h"
#include "daemon/api/routes.h"
#include "daemon/api/run_request.h"
#include "daemon/cell_form/cell_shelf.h"
#include "daemon/files/atomic_file.h"
#include "daemon/tasks/active_calibration.h"
#include "drivers/error.h"

namespace cellcal::daemon {

namespace {

EventFeed::Source source(SessionService& service) {
  return {[&service] { return service.status(); },
          [&service](std::uint64_t seq) { return service.since(seq); }};
}

void refuse_while_under_way(const Status& status) {
  if (!kActivePhases.has(status.phase) && status.phase != Phase::kStopping) return;
  throw BusyError("session " + std::to_string(status.session) +
                  " is running. Wait for its end, or abort it");
}

}  // namespace

Api::Api(SessionService& service, Journal& journal, Access* access, Page page, Examiner* examiner)
    : service_(service),
      journal_(journal),
      access_(access),
      page_(std::move(page)),
      examiner_(examiner),
      drift_watch_(journal),
      local_feed_(source(service)),
      network_feed_(source(service)) {}

std::optional<Response> Api::admit_local(Request& request) const {
  request.caller = {Role::kAdminister, kLocalName};
  return std::nullopt;
}

std::optional<Response> Api::admit_network(Request& request) const {
  const Match found = match(request);
  const bool page = found.route == nullptr && !request.path.starts_with("/v1/");
  const Role needed = found.route != nullptr ? found.route->role
                      : page                 ? Role::kNobody
                                             : Role::kLook;
  if (access_ != nullptr) return access_->admit(request, needed);
  if (needed == Role::kNobody) return std::nullopt;
  return error(401, "a token is needed, and this daemon has none");
}

std::optional<Response> Api::answer(const Request& request, bool give_up) try {
  const Match found = match(request);
  if (found.route == nullptr && found.path_known) {
    return error(405, "wrong method for " + request.path);
  }
  if (found.route == nullptr) {
    if (page_ && request.method == "GET" && !request.path.starts_with("/v1/")) {
      if (auto page = page_(request)) return page;
    }
    return error(404, "no such resource: " + request.path);
  }
  // Already checked on admission; repeated for safety.
  if (request.caller.role < found.route->role) {
    return error(403, std::string("the role ") + to_string(found.route->role) + " is needed");
  }
  return (this->*found.route->answer)({request, found.variable, give_up});
} catch (const BadRequest& bad) {
  return error(400, bad.what());
} catch (const NotFound& none) {
  return error(404, none.what());
} catch (const BusyError& busy) {
  return error(409, busy.what());
} catch (const TokenError& wrong) {
  return error(409, wrong.what());
} catch (const RequestError& wrong) {
  return error(422, wrong.what());
} catch (const NotUsable& refused) {
  return error(refused.why == NotUsable::Why::kNoSession ? 404 : 422, refused.what());
} catch (const calib::FileError& wrong) {
  return error(422, wrong.what());
} catch (const drivers::ConfigError& wrong) {
  return error(422, wrong.what());
} catch (const std::exception& failed) {
  spdlog::error("{} {}: {}", request.method, request.path, failed.what());
  return error(500, system_words(failed));
}

std::optional<Response> Api::health(const Call&) {
  return Response{.body = dump({{"ok", true}, {"version", calib::software_version()}})};
}

Access& Api::access() {
  if (access_ == nullptr) throw NotFound("this daemon has no tokens");
  return *access_;
}

std::optional<Response> Api::me(const Call& call) {
  const Caller& caller = call.request.caller;
  return Response{.body = dump({{"role", to_string(caller.role)}, {"name", caller.name}})};
}

std::optional<Response> Api::status(const Call&) {
  return Response{.body = status_to_json(service_.status())};
}

std::optional<Response> Api::watch(const Call& call) {
  const std::int64_t since = whole_number_in(call.request, "since").value_or(0);
  std::string lines;
  for (const Status& one : service_.since(static_cast<std::uint64_t>(since))) {
    lines += status_to_json(one) + "\n";
  }
  if (lines.empty() && !call.give_up) return std::nullopt;
  return Response{200, "application/x-ndjson", std::move(lines)};
}

std::optional<Response> Api::events(const Call& call) {
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
  response.stream = (request.is_from_network() ? network_feed_ : local_feed_).follow(id);
  if (request.is_from_network())
    response.stream = access().while_admitted(request, response.stream);
  return response;
}

std::optional<Response> Api::with_clear_cell(const Call& call,
                                             const std::function<Response()>& act) {
  const bool afar = call.request.is_from_network();
  const std::string& name = call.request.caller.name;
  if (afar && !access().clearance().take(name)) {
    refuse_while_under_way(service_.status());
    return error(
        412,
        "the cell is not confirmed as clear. Check that no person and nothing is in it, then "
        "confirm: 'The cell is clear' on the page, or POST /v1/clear. It counts for 5 minutes and "
        "one request");
  }
  try {
    return act();
  } catch (...) {
    if (afar) access().clearance().put_back(name);
    throw;
  }
}

void Api::keep_among_cells(const Request& request, const std::filesystem::path& cell) const {
  if (cell.empty()) return;
  NetworkFiles cells{
      "a cell file",
      "Place it there, name its folder in cell_folders of [http], or use 'cellcal' on "
      "the cell's computer",
      cell_folders_};
  if (shelf_ != nullptr) cells.folders.push_back(shelf_->folder());
  keep_within(request, cell, cells);
  if (request.is_from_network() && cell.extension() != ".toml")
    throw RequestError("over the network a cell file's name must end in .toml");
}

std::optional<Response> Api::run(const Call& call) {
  const RunRequest wanted = run_request(call.request.body);
  keep_among_cells(call.request, wanted.cell);
  return with_clear_cell(call, [&] {
    return Response{201, "application/json", dump({{"session", service_.start(wanted)}})};
  });
}

std::optional<Response> Api::clear(const Call& call) {
  refuse_while_under_way(service_.status());
  access().clearance().acknowledge(call.request.caller.name);
  return Response{.body = dump({{"valid_s", kClearanceLasts.count()}})};
}

bool Api::abort_session() {
  if (access_ != nullptr) access_->clearance().forget();
  return service_.abort();
}

std::optional<Response> Api::abort(const Call&) {
  if (!abort_session()) return error(409, "no session is running");
  return Response{202, "application/json", dump({{"session", service_.status().session}})};
}

}  // namespace cellcal::daemon
