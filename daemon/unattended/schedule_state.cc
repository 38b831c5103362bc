#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "calib/words/phrase_json.h"
#include "daemon/unattended/schedule.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

constexpr const char* kFormat = "cellcal.schedule/1";
/// Years of windows; a clock set back farther finds the newest of them.
constexpr std::size_t kMostClosed = 4000;
constexpr std::size_t kMostDecisions = 200;

json to_json(const Decision& d) {
  return {{"at", d.at},
          {"entry", d.entry},
          {"night", d.day},
          {"verb", to_string(d.verb)},
          {"why", to_string(d.why)},
          {"session", d.session},
          {"detail", calib::to_json(d.detail)},
          {"figure_s", d.figure_s}};
}

Decision decision_from(const json& j) {
  return {j.at("at").get<UtcSeconds>(),           j.at("entry").get<std::string>(),
          j.at("night").get<std::string>(),       verb_of(j.at("verb").get<std::string>()),
          why_of(j.at("why").get<std::string>()), j.at("session").get<std::int64_t>(),
          calib::phrase_of(j.at("detail")),       j.at("figure_s").get<double>()};
}

ScheduleState state_from(const json& j) {
  if (j.at("format") != kFormat) throw std::runtime_error("format is not cellcal.schedule/1");
  ScheduleState state;
  j.at("looked").get_to(state.evaluated_until);
  j.at("known").get_to(state.known);
  for (const json& one : j.at("closed"))
    state.closed.push_back({one.at("entry").get<std::string>(), one.at("night").get<std::string>(),
                            one.at("missed").get<bool>()});
  if (!j.at("aborted").is_null())
    state.hold = Hold{j.at("aborted").get<std::int64_t>(),
                      why_of(j.value("hold", to_string(Why::kAbortedBefore)))};
  const json& clock = j.at("clock");
  state.clock = {clock.at("boot").get<std::string>(), clock.at("utc").get<UtcSeconds>(),
                 clock.at("since_boot_s").get<double>()};
  if (const json& doubt = j.at("clock_doubt"); !doubt.is_null())
    state.clock_doubt =
        ClockDoubt{why_of(doubt.at("why").get<std::string>()), doubt.at("set_by_s").get<double>()};
  j.at("released").get_to(state.released);
  j.at("harmless").get_to(state.harmless);
  state.left = j.value("left", "");
  for (const json& one : j.at("decisions")) state.decisions.push_back(decision_from(one));
  return state;
}

}  // namespace

void ScheduleState::hold_from(const Hold& since) {
  hold = since;
  released.clear();
}

bool ScheduleState::is_closed(const std::string& entry, const std::string& day, bool lasts) const {
  return std::any_of(closed.begin(), closed.end(), [&](const ClosedWindow& one) {
    return one.day == day && one.entry == entry && !(lasts && one.missed);
  });
}

void ScheduleState::reopen_missed(const std::string& entry, const std::string& day) {
  std::erase_if(closed, [&](const ClosedWindow& one) {
    return one.missed && one.day == day && one.entry == entry;
  });
}

void ScheduleState::close(const std::string& entry, const std::string& day, bool missed) {
  closed.push_back({entry, day, missed});
  if (closed.size() > kMostClosed) closed.pop_front();
}

void ScheduleState::add(Decision decision) {
  decisions.push_back(std::move(decision));
  if (decisions.size() > kMostDecisions) decisions.pop_front();
}

ScheduleState schedule_state_from(const std::string& text) {
  if (text.empty()) return {};
  try {
    return state_from(json::parse(text));
  } catch (const json::exception&) {
    throw std::runtime_error("the schedule's row is malformed");
  } catch (const std::invalid_argument&) {  // a phrase
    throw std::runtime_error("the schedule's row is malformed");
  }
}

std::string to_text(const ScheduleState& state) {
  json closed = json::array(), decisions = json::array();
  for (const ClosedWindow& one : state.closed)
    closed.push_back({{"entry", one.entry}, {"night", one.day}, {"missed", one.missed}});
  for (const Decision& one : state.decisions) decisions.push_back(to_json(one));
  json doubt;
  if (state.clock_doubt)
    doubt = {{"why", to_string(state.clock_doubt->why)}, {"set_by_s", state.clock_doubt->set_by_s}};
  const json all{{"format", kFormat},
                 {"looked", state.evaluated_until},
                 {"known", state.known},
                 {"closed", std::move(closed)},
                 {"aborted", state.hold ? json(state.hold->session) : json(nullptr)},
                 {"hold", to_string(state.hold.value_or(Hold{}).why)},
                 {"clock",
                  {{"boot", state.clock.boot},
                   {"utc", state.clock.utc},
                   {"since_boot_s", state.clock.since_boot_s}}},
                 {"clock_doubt", std::move(doubt)},
                 {"released", state.released},
                 {"harmless", state.harmless},
                 {"left", state.left},
                 {"decisions", std::move(decisions)}};
  return all.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace cellcal::daemon
