#include "daemon/api/handlers.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <charconv>
#include <nlohmann/json.hpp>

#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "calib/model/error.h"
#include "calib/syntax/input_file.h"
#include "daemon/files/printable.h"
#include "daemon/service/delay_watch.h"
#include "daemon/service/inputs.h"
#include "daemon/session/phase_times.h"
#include "drivers/error.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

constexpr const char* kRunPath = "/v1/run";
constexpr const char* kStatusPath = "/v1/status";
constexpr const char* kWatchPath = "/v1/watch";
constexpr const char* kAbortPath = "/v1/abort";
constexpr const char* kSessionsPath = "/v1/sessions";

/// A request that is wrong in itself.
struct BadRequest : std::runtime_error {
  using std::runtime_error::runtime_error;
};

std::string dump(const json& value) {
  // Words of devices may hold any bytes; what is not UTF-8 is shown as such, never thrown over.
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

Response error(int status, const std::string& words) {
  return {status, "application/json", dump({{"error", words}})};
}

std::optional<std::int64_t> whole_number(const std::string& text) {
  std::int64_t value = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || end != text.data() + text.size() || value < 0) return std::nullopt;
  return value;
}

/// Takes a key out of the object; what remains at the end is unknown.
template <typename T>
void take(json& object, const char* key, T& value) {
  const auto found = object.find(key);
  if (found == object.end()) return;
  const bool fits = std::is_same_v<T, bool>          ? found->is_boolean()
                    : std::is_same_v<T, std::string> ? found->is_string()
                    : std::is_same_v<T, double>
                        ? found->is_number()
                        : found->is_number_unsigned() && found->template get<std::uint64_t>() <=
                                                             std::numeric_limits<int>::max();
  if (!fits) throw BadRequest(std::string("\"") + key + "\" has the wrong type or range");
  value = found->template get<T>();
  object.erase(found);
}

RunRequest run_request(const std::string& body) {
  json object = json::parse(body, nullptr, false);
  if (!object.is_object()) throw BadRequest("the body must be a JSON object");
  RunRequest request;
  std::string cell;
  take(object, "cell", cell);
  if (object.contains("touches")) take(object, "touches", request.fit_touches.emplace());
  if (object.contains("goal_mm")) take(object, "goal_mm", request.goal_mm.emplace());
  take(object, "region", request.region);
  take(object, "find", request.find);
  take(object, "accept_change", request.accept_change);
  take(object, "check", request.check_touches);
  take(object, "seed", request.seed);
  take(object, "resume", request.resume);
  if (!object.empty()) throw BadRequest("unknown key \"" + object.begin().key() + "\"");
  if (cell.empty() && !request.resume) throw BadRequest("\"cell\" is missing");
  if (printable(cell) != cell || printable(request.region) != request.region)
    throw BadRequest("\"cell\" and \"region\" must not contain control characters");
  request.cell = cell;
  return request;
}

json to_json(const SessionRecord& record) {
  return {
      {"id", record.id},           {"started", record.started},       {"ended", record.ended},
      {"state", record.state},     {"cell", record.inputs.cell_name}, {"touches", record.touches},
      {"planned", record.planned}, {"failure", record.failure}};
}

json to_json(const PhaseTimes& times) {
  json activities = json::array();
  for (const Activity activity : kAllActivities) {
    const ActivityTime& one = times[activity];
    activities.push_back({{"activity", to_string(activity)},
                          {"driver", driver_of(activity)},
                          {"count", one.count},
                          {"total_s", one.total_s},
                          {"worst_s", one.worst_s}});
  }
  return {{"touches", times.touches}, {"total_s", times.total_s}, {"activities", activities}};
}

template <typename T>
json or_null(const std::optional<T>& value, double factor = 1.0) {
  if (!value) return nullptr;
  if constexpr (std::is_same_v<T, double>) return *value * factor;
  return *value;
}

std::string hex(std::uint32_t value, int digits) { return fmt::format("{:0{}x}", value, digits); }

json to_json(const drivers::RobotState& robot) {
  const drivers::RobotQuality& q = robot.quality;
  return {{"cycle_ms", robot.cycle_s * 1e3},
          {"jitter_ms", q.jitter_s * 1e3},
          {"longest_gap_ms", q.longest_gap_s * 1e3},
          {"packets", robot.packets},
          {"gaps", q.gaps},
          {"bad_packets", q.bad_packets},
          {"late", robot.late},
          {"replies", q.replies},
          {"reply_ms",
           {{"p50", q.reply_p50_s * 1e3},
            {"p99", q.reply_p99_s * 1e3},
            {"p999", q.reply_p999_s * 1e3},
            {"max", q.reply_max_s * 1e3}}}};
}

json to_json(const drivers::ContactStatus& contact) {
  const drivers::ContactQuality& q = contact.quality;
  const drivers::ContactIdentity& id = contact.identity;
  return {
      {"protocol", id.protocol},
      {"firmware", fmt::format("{}.{}.{}", id.firmware[0], id.firmware[1], id.firmware[2])},
      {"uid", hex(id.uid, 8)},
      {"boot_id", id.boot_id},
      {"config_crc", hex(id.config_crc, 4)},
      {"in_contact", contact.in_contact},
      {"loop_ok", contact.loop_ok},
      {"self_test_ok", contact.self_test_ok},
      {"frames", q.frames},
      {"crc_errors", q.crc_errors},
      {"gaps", q.gaps},
      {"unknown_types", q.unknown_types},
      {"bounces", q.bounces},
      {"round_trip_ms",
       {{"min", q.round_trip_min_s * 1e3},
        {"p50", q.round_trip_p50_s * 1e3},
        {"p99", q.round_trip_p99_s * 1e3}}},
      {"clock_sigma_us", q.clock_sigma_s * 1e6},
      {"clock_drift_ppm", q.clock_drift_ppm},
      {"heartbeat_jitter_ms", q.heartbeat_jitter_s * 1e3},
      {"late_ms",
       {{"p50", q.late_p50_s * 1e3},
        {"max", q.late_max_s * 1e3},
        {"worst", q.late_worst_s * 1e3},
        {"limit", std::chrono::duration<double, std::milli>(drivers::kHeartbeatLimit).count()}}},
      {"sense_v", contact.sense_voltage_v},
      {"contact_v", q.contact_voltage_v}};
}

json to_json(const std::optional<Waiting>& waiting) {
  if (!waiting) return nullptr;
  return {{"robot", waiting->robot},
          {"contact", waiting->contact},
          {"left_s", waiting->left_s},
          {"start", waiting->start}};
}

json to_json(const std::shared_ptr<const LinkReport>& links) {
  if (!links) return nullptr;
  return {{"open", links->open},
          {"robot", to_json(links->robot)},
          {"contact", to_json(links->contact)}};
}

}  // namespace

std::string status_to_json(const Status& status) {
  json value{{"seq", status.seq},
             {"session", status.session},
             {"phase", to_string(status.phase)},
             {"running", kActivePhases.has(status.phase) || status.phase == Phase::kStopping},
             {"target", status.target},
             {"touches", status.done},
             {"planned", status.total},
             {"residual_mm", or_null(status.residual_m, 1e3)},
             {"goal_mm", or_null(status.goal_m, 1e3)},
             {"u95_mm", or_null(status.u95_m, 1e3)},
             {"mean_error_mm", or_null(status.mean_error_m, 1e3)},
             {"finding", status.finding},
             {"stage", status.stage},
             {"why_ended", status.why_ended},
             {"time_left_s", or_null(status.time_left_s)},
             {"waiting", to_json(status.waiting)},
             {"interruptions", status.interruptions},
             {"robot", status.robot_words},
             {"contact", status.contact_words},
             {"publish", or_null(status.publish)},
             {"reasons", status.reasons},
             {"results", status.results_dir},
             {"links", to_json(status.links)},
             {"version", calib::software_version()},
             {"interrupted", nullptr},
             {"failure", nullptr}};
  if (status.interrupted) {
    value["interrupted"] = {{"session", status.interrupted->session},
                            {"touches", status.interrupted->touches},
                            {"planned", status.interrupted->planned},
                            {"started", status.interrupted->started}};
  }
  if (status.failure) {
    value["failure"] = {{"kind", to_string(status.failure->kind)},
                        {"detail", status.failure->detail}};
  }
  return dump(value);
}

std::optional<Response> Api::answer(const Request& request, bool give_up) try {
  const bool get = request.method == "GET";
  const bool post = request.method == "POST";
  const std::string& path = request.path;
  const bool posted = path == kRunPath || path == kAbortPath;
  const bool got = path == kStatusPath || path == kWatchPath || path.rfind(kSessionsPath, 0) == 0;
  if (!posted && !got) return error(404, "no such resource: " + path);
  if ((posted && !post) || (got && !get)) return error(405, "wrong method for " + path);

  if (path == kRunPath) return run(request);
  if (path == kAbortPath) return abort();
  if (path == kStatusPath) return Response{.body = status_to_json(service_.status())};
  if (path == kSessionsPath) return sessions();
  if (path != kWatchPath) return session(path.substr(std::string(kSessionsPath).size()));

  const auto since = request.query.find("since");
  const auto seq = whole_number(since == request.query.end() ? "0" : since->second);
  if (!seq) return error(400, "\"since\" must be a whole number");
  std::string lines;
  for (const Status& status : service_.since(static_cast<std::uint64_t>(*seq))) {
    lines += status_to_json(status) + "\n";
  }
  if (lines.empty() && !give_up) return std::nullopt;
  return Response{200, "application/x-ndjson", std::move(lines)};
} catch (const BadRequest& bad) {
  return error(400, bad.what());
} catch (const BusyError& busy) {
  return error(409, busy.what());
} catch (const RequestError& wrong) {
  return error(422, wrong.what());
} catch (const calib::FileError& wrong) {
  return error(422, wrong.what());
} catch (const drivers::ConfigError& wrong) {
  return error(422, wrong.what());
} catch (const std::exception& failed) {
  spdlog::error("{} {}: {}", request.method, request.path, failed.what());
  return error(500, failed.what());
}

bool Api::is_slow(const Request& request) {
  return request.path == kRunPath || request.path.rfind(kSessionsPath, 0) == 0;
}

Response Api::run(const Request& request) {
  const std::int64_t session = service_.start(run_request(request.body));
  return {201, "application/json", dump({{"session", session}})};
}

Response Api::abort() {
  if (!service_.abort()) return error(409, "no session is running");
  return {202, "application/json", dump({{"session", service_.status().session}})};
}

Response Api::sessions() {
  json list = json::array();
  for (const SessionRecord& record : journal_.sessions()) list.push_back(to_json(record));
  return {200, "application/json", dump(list)};
}

/// "/7" or "/7/report.html".
Response Api::session(const std::string& rest) {
  if (rest.empty() || rest[0] != '/') return error(404, "no such resource");
  const std::size_t slash = rest.find('/', 1);
  const auto id = whole_number(rest.substr(1, slash == std::string::npos ? slash : slash - 1));
  const auto record = id ? journal_.session(*id) : std::nullopt;
  if (!record) return error(404, "no session " + rest.substr(1) + ". See 'cellcal history'");
  if (slash != std::string::npos) return result(*id, rest.substr(slash + 1));
  json value = to_json(*record);
  const std::vector<std::string> events = journal_.events(*id);
  value["events"] = events;
  value["times"] = to_json(phase_times(events));
  value["contact_delay"] = nullptr;
  if (const auto delay = delay_of(journal_, *id)) {
    value["contact_delay"] = {{"ms", 1e3 * delay->delay_s},
                              {"sigma_ms", 1e3 * delay->sigma_s},
                              {"touches", delay->touches},
                              {"words", in_words(*delay)},
                              {"warning", complaint(*delay, delay_before(journal_, *id))}};
  }
  value["results"] = service_.results_dir(*id).string();
  return {200, "application/json", dump(value)};
}

Response Api::result(std::int64_t session, const std::string& file) {
  if (file == "touches.csv") {
    const auto record = journal_.session(session);
    return {200, "text/csv",
            calib::format_touches(journal_.touches(session), cell_of(record->inputs).robot)};
  }
  // Only these names: nothing of a request ever becomes part of a path.
  const bool json_file = file == "calibration.json";
  if (!json_file && file != "report.html") return error(404, "no such result");
  const std::filesystem::path path =
      service_.results_dir(session) / (json_file ? "calibration.json" : "report.html");
  if (!std::filesystem::exists(path)) {
    return error(404, "session " + std::to_string(session) + " has no result. See 'cellcal show " +
                          std::to_string(session) + "'");
  }
  return {200, json_file ? "application/json" : "text/html; charset=utf-8", calib::read_file(path)};
}

}  // namespace cellcal::daemon
