// What the journal and the results' folder hold of sessions.

#include <algorithm>
#include <filesystem>
#include <limits>

#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/model/long_work.h"
#include "calib/model/units.h"
#include "daemon/api/handlers.h"
#include "daemon/api/http/json_text.h"
#include "daemon/api/live/status_json.h"
#include "daemon/api/routes.h"
#include "daemon/api/run_request.h"
#include "daemon/result/outcome_json.h"
#include "daemon/session/phase_times.h"
#include "daemon/tasks/recorded/delay_watch.h"
#include "daemon/tasks/recorded/inputs.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

constexpr std::int64_t kUsualPage = 100, kLargestPage = 1000;

/// Of a damaged row, or one of another version, nobody knows.
json kind_of(const SessionRecord& record) {
  try {
    return to_string(options_from_json(record.inputs.options).kind);
  } catch (const std::runtime_error&) {
    return nullptr;
  }
}

/// None of one that is not done, or ended before outcomes were recorded.
std::optional<SessionOutcome> outcome_of(const SessionRecord& record) {
  if (record.state != RecordState::kDone) return std::nullopt;
  return outcome_from_json(record.outcome);
}

/// Of a check that decided something: whether the calibration held. Null of all else.
json holds(const SessionRecord& record) {
  const auto outcome = outcome_of(record);
  if (!outcome) return nullptr;
  if (outcome->kind == OutcomeKind::kHolds) return true;
  return outcome->kind == OutcomeKind::kDoesNotHold ? json(false) : json();
}

json to_json(const SessionRecord& record) {
  json value{{"kind", kind_of(record)},
             {"id", record.id},
             {"started", record.started},
             {"ended", record.ended},
             {"state", to_string(record.state)},
             {"cell", record.inputs.cell_name},
             {"touches", record.touches},
             {"planned", record.planned},
             {"failure", record.failure},
             {"outcome", outcome_with_words(outcome_of(record))},
             {"holds", holds(record)},
             {"imported", nullptr},
             {"raw_dropped", record.dropped.empty() ? json(nullptr) : json(record.dropped)}};
  if (record.origin)
    value["imported"] = {{"journal", record.origin->journal}, {"session", record.origin->session}};
  return value;
}

/// `by_cause`: none of them where they were not recorded.
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

std::int64_t page_size(const Request& request, std::int64_t usual) {
  const std::int64_t limit = whole_number_in(request, "limit").value_or(usual);
  if (limit < 1 || limit > kLargestPage) throw BadRequest("\"limit\" must be 1 to 1000");
  return limit;
}

struct Part {
  std::size_t begin = 0, end = 0;
  bool more = false;
};

/// Those of `count` that follow the one with the number `after`; from the first without it.
Part part_of(const Request& request, std::size_t count) {
  const auto limit = static_cast<std::size_t>(page_size(request, kUsualPage));
  const auto after = whole_number_in(request, "after");
  Part part;
  part.begin = after ? std::min(count, static_cast<std::size_t>(*after) + 1) : 0;
  part.end = part.begin + std::min(limit, count - part.begin);
  part.more = part.end < count;
  return part;
}

}  // namespace

SessionRecord Api::find(const Call& call) {
  const auto id = whole_number(call.variable);
  auto record = id ? journal_.session(*id) : std::nullopt;
  if (!record) {
    throw NotFound("no session " + std::string(call.variable) + ". See 'cellcal history'");
  }
  return std::move(*record);
}

std::optional<Response> Api::sessions(const Call& call) {
  const auto before = whole_number_in(call.request, "before");
  const bool whole = !call.request.query.contains("limit");
  const auto limit = whole ? std::size_t(-1) : static_cast<std::size_t>(page_size(call.request, 0));
  json list = json::array();
  for (SessionRecord& record :
       journal_.sessions(before.value_or(std::numeric_limits<std::int64_t>::max()), limit)) {
    calib::poll_cancelled();
    if (!journal_.is_whole(record.id)) record.state = RecordState::kDamaged;
    list.push_back(to_json(record));
    list.back()["published"] = published(record);
  }
  return Response{.body = dump(list)};
}

std::optional<Response> Api::session(const Call& call) {
  const SessionRecord record = find(call);
  json value = to_json(record);
  value["published"] = published(record);
  const std::vector<std::string> events = journal_.events(record.id);
  value["events"] = events;
  value["times"] = to_json(phase_times(events), journal_.interruptions(record.id));
  value["contact_delay"] = nullptr;
  if (const auto delay = delay_of(journal_, record.id)) {
    value["contact_delay"] = {{"ms", calib::kMsPerS * delay->delay_s},
                              {"sigma_ms", calib::kMsPerS * delay->sigma_s},
                              {"touches", delay->touches},
                              {"words", in_words(*delay)},
                              {"warning", complaint(*delay, delay_before(journal_, record.id))}};
  }
  value["results"] = service_.results_dir(record.id).string();
  return Response{.body = dump(value)};
}

std::optional<Response> Api::session_touches(const Call& call) {
  const SessionRecord record = find(call);
  const std::vector<calib::Touch> touches = journal_.touches(record.id);
  const Part part = part_of(call.request, touches.size());
  json list = json::array();
  for (std::size_t i = part.begin; i < part.end; ++i) list.push_back(touch_json(i, touches[i]));
  return Response{.body = dump({{"session", record.id}, {"touches", list}, {"more", part.more}})};
}

std::optional<Response> Api::session_events(const Call& call) {
  const SessionRecord record = find(call);
  const std::vector<std::string> events = journal_.events(record.id);
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

std::optional<Response> Api::touches_csv(const Call& call) {
  const SessionRecord record = find(call);
  return Response{200, "text/csv",
                  calib::format_touches(journal_.touches(record.id), cell_of(record.inputs).robot)};
}

std::optional<Response> Api::calibration(const Call& call) {
  return result_file(call, "calibration.json", "application/json");
}

std::optional<Response> Api::qualification(const Call& call) {
  return result_file(call, "qualification.json", "application/json");
}

std::optional<Response> Api::found(const Call& call) {
  return result_file(call, "found.json", "application/json");
}

std::optional<Response> Api::check(const Call& call) {
  return result_file(call, "check.json", "application/json");
}

/// Of a calibration that is done: whether its verdict published it. Null of all else.
json Api::published(const SessionRecord& record) const {
  if (record.state != RecordState::kDone) return nullptr;
  if (const auto outcome = outcome_of(record)) {
    const std::optional<bool> was = cellcal::daemon::published(*outcome);
    return was ? json(*was) : json(nullptr);
  }
  const std::optional<bool> was = journal_.was_published(record.id);
  return was ? json(*was) : json(nullptr);
}

std::optional<Response> Api::report(const Call& call) {
  Response page = result_file(call, "report.html", "text/html; charset=utf-8");
  // It comes from where the page comes from, and must not act as that may, whatever words are in it.
  page.headers = {{"Content-Security-Policy",
                   "sandbox; default-src 'none'; style-src 'unsafe-inline'; img-src data:"}};
  return page;
}

/// Nothing of a request ever becomes part of a path.
Response Api::result_file(const Call& call, const char* name, const char* type) {
  const std::int64_t session = find(call).id;
  const std::filesystem::path path = service_.results_dir(session) / name;
  if (!std::filesystem::exists(path)) {
    throw NotFound("session " + std::to_string(session) + " has no result. See 'cellcal show " +
                   std::to_string(session) + "'");
  }
  return {200, type, calib::read_file(path)};
}

}  // namespace cellcal::daemon
