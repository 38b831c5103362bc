// Sessions in the journal and in the results folder.

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/files/json.h"
#include "calib/model/long_work.h"
#include "calib/model/units.h"
#include "daemon/api/event_feed.h"
#include "daemon/api/handlers.h"
#include "daemon/api/http/http.h"
#include "daemon/archive/archive.h"
#include "daemon/files/atomic_file.h"
#include "daemon/report/report.h"
#include "daemon/result/outcome_json.h"
#include "daemon/runner/backend.h"
#include "daemon/session/phase.h"
#include "daemon/tasks/options.h"
#include "daemon/tasks/tasks.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

constexpr std::int64_t kUsualPage = 100, kLargestPage = 1000;

/// nullopt for a session that is not done.
std::optional<SessionOutcome> outcome_of(const SessionRecord& record) {
  return record.state == RecordState::kDone ? record.outcome : std::nullopt;
}

/// True if the verdict of a finished calibration published it; null for other sessions.
json published(const SessionRecord& record) {
  const auto outcome = outcome_of(record);
  const std::optional<bool> was = outcome ? published(*outcome) : std::nullopt;
  return was ? json(*was) : json(nullptr);
}

/// Result of a conclusive check: true if the calibration holds. Null otherwise.
json holds(const SessionRecord& record) {
  const auto outcome = outcome_of(record);
  if (!outcome) return nullptr;
  if (outcome->kind == OutcomeKind::kHolds) return true;
  return outcome->kind == OutcomeKind::kDoesNotHold ? json(false) : json();
}

json to_json(const SessionRecord& record, const calib::Language& language) {
  const std::optional<SessionOptions> options = options_in(record.inputs);
  json value{{"kind", options ? json(to_string(options->kind)) : json(nullptr)},
             {"load", options && !options->load.empty() ? json(options->load) : json(nullptr)},
             {"id", record.id},
             {"started", record.started},
             {"ended", record.ended},
             {"state", to_string(record.state)},
             {"cell", record.inputs.cell_name},
             {"touches", record.touches},
             {"planned", record.planned},
             {"failure", record.failure_words(language)},
             {"outcome", outcome_with_words(outcome_of(record), language)},
             {"holds", holds(record)},
             {"published", published(record)},
             {"imported", nullptr},
             {"raw_dropped", record.dropped.empty() ? json(nullptr) : json(record.dropped)}};
  if (record.origin)
    value["imported"] = {{"journal", record.origin->journal}, {"session", record.origin->session}};
  return value;
}

/// `by_cause`: empty where causes were not recorded.
json to_json(const PhaseTimes& times, const InterruptionCounts& by_cause) {
  json activities = json::array();
  for (const Activity activity : kAllActivities) {
    const ActivityTime& one = times[activity];
    activities.push_back({{"activity", to_string(activity)},
                          {"driver", driver_of(activity)},
                          {"count", one.count},
                          {"total_s", one.total_s},
                          {"worst_s", one.worst_s}});
  }
  return {{"touches", times.touches},
          {"interruptions", times.interruptions},
          {"interruptions_by_cause",
           by_cause.total() == 0 && times.interruptions > 0 ? json(nullptr) : to_json(by_cause)},
          {"total_s", times.total_s},
          {"activities", activities}};
}

NotFound no_result(std::int64_t session) {
  return NotFound(
      fmt::format("session {0} has no result of this kind. See 'cellcal show {0}'", session));
}

std::int64_t page_size(const Request& request, std::int64_t usual) {
  const std::int64_t limit = whole_number_in(request, "limit").value_or(usual);
  if (limit < 1 || limit > kLargestPage) throw BadRequest("\"limit\" must be 1 to 1000");
  return limit;
}

struct Part {
  std::size_t begin = 0, end = 0;
  bool more = false;
};

/// Page of `count` items after the number `after`; from the first without it.
Part part_of(const Request& request, std::size_t count) {
  const auto limit = static_cast<std::size_t>(page_size(request, kUsualPage));
  const auto after = whole_number_in(request, "after");
  Part part;
  part.begin = after ? std::min(count, static_cast<std::size_t>(*after) + 1) : 0;
  part.end = part.begin + std::min(limit, count - part.begin);
  part.more = part.end < count;
  return part;
}

Answer sessions(Api& api, const Call& call) {
  const auto before = whole_number_in(call.request, "before");
  const bool whole = !call.request.query.contains("limit");
  const auto limit = whole ? std::size_t(-1) : static_cast<std::size_t>(page_size(call.request, 0));
  const calib::Language language = language_in(call.request);
  json list = json::array();
  for (SessionRecord& record :
       api.journal.sessions(before.value_or(std::numeric_limits<std::int64_t>::max()), limit)) {
    calib::poll_cancelled();
    if (!api.journal.is_whole(record.id)) record.state = RecordState::kDamaged;
    list.push_back(to_json(record, language));
  }
  return Response{.body = dump(list)};
}

Answer session(Api& api, const Call& call) {
  const SessionRecord record = find_session(api, call);
  json value = to_json(record, language_in(call.request));
  value["events"] = api.journal.events(record.id);
  value["times"] =
      to_json(phase_times(api.journal.changes(record.id)), api.journal.interruptions(record.id));
  value["contact_delay"] = nullptr;
  if (const auto delay = delay_of(api.journal, record.id)) {
    value["contact_delay"] = {{"ms", calib::kMsPerS * delay->delay_s},
                              {"sigma_ms", calib::kMsPerS * delay->sigma_s},
                              {"touches", delay->touches},
                              {"words", in_words(*delay)},
                              {"warning", complaint(*delay, delay_before(api.journal, record.id))}};
  }
  value["results"] = api.service.results_dir(record.id).string();
  return Response{.body = dump(value)};
}

Answer session_touches(Api& api, const Call& call) {
  const SessionRecord record = find_session(api, call);
  const std::vector<calib::Touch> touches = api.journal.touches(record.id);
  const Part part = part_of(call.request, touches.size());
  const bool linear_unit = cell_of(record.inputs).robot.first_turning() > 0;
  json list = json::array();
  for (std::size_t i = part.begin; i < part.end; ++i)
    list.push_back(touch_json(i, touches[i], linear_unit));
  return Response{.body = dump({{"session", record.id}, {"touches", list}, {"more", part.more}})};
}

Answer session_events(Api& api, const Call& call) {
  const SessionRecord record = find_session(api, call);
  const std::vector<std::string> events = api.journal.events(record.id);
  const Part part = part_of(call.request, events.size());
  json list = json::array();
  for (std::size_t i = part.begin; i < part.end; ++i) {
    const std::size_t gap = std::min(events[i].find(' '), events[i].size());
    list.push_back({{"index", i},
                    {"time", events[i].substr(0, gap)},
                    {"words", events[i].substr(std::min(gap + 1, events[i].size()))}});
  }
  return Response{.body = dump({{"session", record.id}, {"events", list}, {"more", part.more}})};
}

Answer touches_csv(Api& api, const Call& call) {
  const SessionRecord record = find_session(api, call);
  return Response{
      200, "text/csv",
      calib::format_touches(api.journal.touches(record.id), cell_of(record.inputs).robot)};
}

/// A result as the journal has it; throws NotFound where the session is of another kind or has none.
template <std::string SessionRecord::*kText, SessionKind kKind>
Answer document(Api& api, const Call& call) {
  const SessionRecord record = find_session(api, call);
  const auto options = options_in(record.inputs);
  if ((record.*kText).empty() || !options || options->kind != kKind) throw no_result(record.id);
  return Response{200, "application/json", record.*kText};
}

/// The session's file; where its folder was lost, the same made from the journal.
template <class Make>
std::string file_or(const std::filesystem::path& file, Journal& journal,
                    const SessionRecord& record, const calib::Language& language,
                    const Make& make) {
  if (std::filesystem::exists(file)) return calib::read_file(file);
  if (record.calibration.empty()) throw no_result(record.id);
  ReportInput report = report_from_journal(journal, record);
  report.language = language;
  return make(report);
}

Answer report_html(Api& api, const Call& call) {
  const SessionRecord record = find_session(api, call);
  const calib::Language language = language_in(call.request);
  const std::filesystem::path results = api.service.results_dir(record.id);
  std::filesystem::path path = results / report_name(language);
  // Sessions of earlier versions have it in English alone.
  if (!std::filesystem::exists(path)) path = results / report_name({});
  Response page{200, "text/html; charset=utf-8",
                file_or(path, api.journal, record, language, html_report)};
  // Same origin as the page, but sandboxed, whatever text the report contains.
  page.headers = {{"Content-Security-Policy",
                   "sandbox; default-src 'none'; style-src 'unsafe-inline'; img-src data:"}};
  return page;
}

Answer plots(Api& api, const Call& call) {
  const SessionRecord record = find_session(api, call);
  const calib::Language language = language_in(call.request);
  return Response{200, "application/json",
                  file_or(api.service.results_dir(record.id) / plots_name(language), api.journal,
                          record, language, [&](const ReportInput& report) {
                            return plots_json(record.id, report_plots(report));
                          })};
}

// Deletion of raw rows of old sessions on request.

constexpr int kMostDays = 36500;
constexpr double kMostMegabytes = 1e9;

struct Wanted {
  RetentionRule rule;
  bool dry_run = false;
};

/// {"dry_run": true, "days": 90, "megabytes": 500}, each optional.
Wanted wanted_in(const std::string& body) {
  const json object = object_in(body);
  Wanted wanted;
  for (const auto& [key, value] : object.items()) {
    if (key == "dry_run" && value.is_boolean()) {
      wanted.dry_run = value;
    } else if (key == "days" && value.is_number_integer() && value >= 1 && value <= kMostDays) {
      wanted.rule.days = value.get<int>();
    } else if (key == "megabytes" && value.is_number() && value >= 1.0 && value <= kMostMegabytes) {
      wanted.rule.megabytes = value.get<double>();
    } else {
      throw BadRequest(
          "\"dry_run\" (true or false), \"days\" (1 to 36500) and \"megabytes\" (from 1 on) are known here, not "
          "this: " +
          dump(json{{key, value}}));
    }
  }
  return wanted;
}

Answer retain(Api& api, const Call& call) {
  Wanted wanted = wanted_in(call.request.body);
  if (!wanted.rule.any() && api.retention) wanted.rule = api.retention();
  if (!wanted.rule.any())
    throw RequestError("no limit given: give days or megabytes, or set them under [retention]");
  const auto idle = [&api] { return !kActivePhases.has(api.service.status().phase); };
  if (!idle()) throw BusyError("a session is running. Drop old rows when it has ended");
  const auto now = std::chrono::duration_cast<std::chrono::seconds>(
      std::chrono::system_clock::now().time_since_epoch());
  const auto gone = api.journal.retain(limits_of(wanted.rule, now.count()), wall_clock_utc(),
                                       wanted.dry_run, idle);
  json sessions = json::array();
  for (const DroppedRows& one : gone)
    sessions.push_back({{"session", one.session}, {"rows", one.rows}, {"bytes", one.bytes}});
  if (!wanted.dry_run && !gone.empty())
    spdlog::info("raw events and readings of {} sessions dropped", gone.size());
  return Response{.body = dump({{"dry_run", wanted.dry_run},
                                {"sessions", std::move(sessions)},
                                {"bytes_in_use", api.journal.bytes_in_use()}})};
}

// Export and import of sessions, and backup of the journal.

std::filesystem::path path_in(const std::string& body, const char* key) {
  const json object = calib::parse_json(body);
  const bool fits =
      object.is_object() && object.size() == 1 && object.contains(key) && object[key].is_string();
  if (!fits)
    throw RequestError(fmt::format("the body must be {{\"{}\": \"/absolute/path\"}}", key));
  const std::string text = object[key];
  const std::filesystem::path path = text;
  if (!path.is_absolute() || printable(text) != text)
    throw RequestError(
        fmt::format("\"{}\" must be an absolute path without control characters", key));
  return path;
}

/// Errors in a named file are errors of the request.
template <class Act>
auto as_request(Act act) {
  try {
    return act();
  } catch (const ArchiveError& wrong) {
    throw RequestError(wrong.what());
  } catch (const JournalError& wrong) {
    throw RequestError(wrong.what());
  } catch (const std::filesystem::filesystem_error& wrong) {
    throw RequestError(system_words(wrong));
  }
}

/// Write access to the folder of imports does not extend to reading other files.
void refuse_links_in(const std::filesystem::path& directory) {
  for (const auto& entry : std::filesystem::directory_iterator(directory))
    if (entry.is_symlink())
      throw RequestError(entry.path().string() +
                         ": is a link, which a request over the network must not follow");
}

Answer export_session(Api& api, const Call& call) {
  const std::int64_t session = find_session(api, call).id;
  return as_request([&] {
    return Response{
        .body = dump(json(make_archive(api.journal, session, api.service.results_dir(session))))};
  });
}

Answer import_session(Api& api, const Call& call) {
  const std::filesystem::path directory = path_in(call.request.body, "directory");
  keep_within(call.request, directory,
              {"an export to be imported",
               "Place it there, or use 'cellcal import' on the cell's computer",
               {api.service.imports_dir()}});
  Imported imported;
  as_request([&] {
    if (call.request.is_from_network()) refuse_links_in(directory);
    const Archive archive = read_archive(directory);
    api.service.alone("an import", [&] {
      imported =
          import_archive(api.journal, archive, directory.string(),
                         [&](std::int64_t session) { return api.service.results_dir(session); });
    });
  });
  if (imported.is_new)
    spdlog::info("session {} imported from {}", imported.session, directory.string());
  return Response{201, "application/json",
                  dump({{"session", imported.session}, {"new", imported.is_new}})};
}

Answer back_up(Api& api, const Call& call) {
  const std::filesystem::path file = path_in(call.request.body, "file");
  keep_within(call.request, file,
              {"a backup",
               "Choose a file there, or use 'cellcal backup' on the cell's computer",
               {api.service.backups_dir()}});
  return as_request([&] {
    if (call.request.is_from_network())
      std::filesystem::create_directories(api.service.backups_dir());
    const std::vector<std::string> remarks = api.journal.backup(file);
    for (const std::string& remark : remarks) spdlog::warn("{}", remark);
    spdlog::info("journal copied to {}", file.string());
    return Response{201, "application/json",
                    dump({{"file", file.string()},
                          {"bytes", std::filesystem::file_size(file)},
                          {"remarks", remarks}})};
  });
}

}  // namespace

SessionRecord find_session(Api& api, const Call& call) {
  const auto id = whole_number(call.variable);
  auto record = id ? api.journal.session(*id) : std::nullopt;
  if (!record) {
    throw NotFound("no session " + std::string(call.variable) + ". See 'cellcal history'");
  }
  return std::move(*record);
}

std::span<const Api::Route> session_routes() {
  static constexpr Api::Route kRoutes[] = {
      {"GET", "/v1/sessions", Role::kView, kSlow, sessions},
      {"GET", "/v1/sessions/{id}", Role::kView, kSlow, session},
      {"GET", "/v1/sessions/{id}/touches", Role::kView, kSlow, session_touches},
      {"GET", "/v1/sessions/{id}/events", Role::kView, kSlow, session_events},
      {"GET", "/v1/sessions/{id}/touches.csv", Role::kView, kSlow, touches_csv},
      {"GET", "/v1/sessions/{id}/calibration.json", Role::kView, kSlow,
       document<&SessionRecord::calibration, SessionKind::kCalibrate>},
      {"GET", "/v1/sessions/{id}/qualification.json", Role::kView, kSlow,
       document<&SessionRecord::document, SessionKind::kQualify>},
      {"GET", "/v1/sessions/{id}/found.json", Role::kView, kSlow,
       document<&SessionRecord::document, SessionKind::kFind>},
      {"GET", "/v1/sessions/{id}/check.json", Role::kView, kSlow,
       document<&SessionRecord::document, SessionKind::kCheck>},
      {"GET", "/v1/sessions/{id}/report.html", Role::kView, kSlow, report_html},
      {"GET", "/v1/sessions/{id}/plots", Role::kView, kSlow, plots},
      {"POST", "/v1/retain", Role::kAdminister, kSlow, retain},
      {"GET", "/v1/sessions/{id}/export", Role::kView, kSlow, export_session},
      {"POST", "/v1/import", Role::kAdminister, kSlow, import_session},
      {"POST", "/v1/backup", Role::kAdminister, kSlow, back_up},
  };
  return kRoutes;
}

}  // namespace cellcal::daemon
