// What begins without a person, and when.

#include <nlohmann/json.hpp>

#include "daemon/api/handlers.h"
#include "daemon/api/http/json_text.h"
#include "daemon/api/routes.h"
#include "daemon/schedule/schedule.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

json to_json(const Decision& d) {
  return {{"at", local_time(d.at)},    {"utc_s", d.at},
          {"entry", d.entry},          {"night", d.night},
          {"verb", to_string(d.verb)}, {"why", to_string(d.why)},
          {"session", d.session},      {"words", words(d)}};
}

json to_json(const Night& night) {
  if (!night.exists()) return nullptr;
  return {{"begins", local_time(night.begins)},
          {"ends", local_time(night.ends)},
          {"begins_utc_s", night.begins},
          {"ends_utc_s", night.ends}};
}

json to_json(const SchedulePicture::Entry& entry) {
  return {{"name", entry.session.name},
          {"kind", entry.session.kind},
          {"cell", entry.session.cell.string()},
          {"on_request", entry.session.on_request},
          {"now", to_json(entry.now)},
          {"next", to_json(entry.next)},
          {"foreseen_s", entry.foreseen_s},
          {"last", entry.last ? to_json(*entry.last) : json(nullptr)}};
}

}  // namespace

Schedule& Api::schedule() {
  if (schedule_ == nullptr) throw NotFound("this daemon has no schedule");
  return *schedule_;
}

std::optional<Response> Api::show_schedule(const Call&) {
  const SchedulePicture picture = schedule().picture();
  json entries = json::array(), decisions = json::array();
  for (const auto& entry : picture.entries) entries.push_back(to_json(entry));
  for (const Decision& one : picture.decisions) decisions.push_back(to_json(one));
  return Response{
      .body = dump({{"unattended", picture.unattended},
                    {"responsible", picture.responsible},
                    {"resumes", picture.resumes},
                    {"held", picture.held_words.empty() ? json(nullptr) : json(picture.held_words)},
                    {"entries", std::move(entries)},
                    {"decisions", std::move(decisions)}})};
}

std::optional<Response> Api::begin_scheduled(const Call& call) {
  const json body = json::parse(call.request.body, nullptr, false);
  const bool fits =
      body.is_object() && body.size() == 1 && body.contains("name") && body["name"].is_string();
  if (!fits) throw BadRequest("the body must be {\"name\": \"a session of the schedule\"}");
  return with_clear_cell(call, [&] {
    const Decision decision = schedule().begin(body["name"]);
    if (decision.verb != Verb::kBegun) throw BusyError(words(decision));
    return Response{201, "application/json", dump({{"session", decision.session}})};
  });
}

std::optional<Response> Api::release_schedule(const Call& call) {
  return with_clear_cell(call, [&] {
    const Decision decision = schedule().release(call.request.caller.name);
    if (decision.verb != Verb::kReleased) throw BusyError(words(decision));
    return Response{.body = dump(json::object())};
  });
}

}  // namespace cellcal::daemon
