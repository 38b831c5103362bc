// Published calibrations as versions (/v1/versions), the next step to a calibrated cell (/v1/readiness), and the doctor
// within the daemon (/v1/doctor).

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <nlohmann/json.hpp>

#include "calib/files/json.h"
#include "calib/model/enum_table.h"
#include "calib/model/units.h"
#include "daemon/api/handlers.h"
#include "daemon/api/http/http.h"
#include "daemon/archive/versions.h"
#include "daemon/doctor/examiner.h"
#include "daemon/doctor/steps.h"
#include "daemon/files/atomic_file.h"
#include "daemon/runner/backend.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

constexpr std::int64_t kUsualVersions = 20, kMostVersions = 100;
using calib::kMmPerM;

json to_json(const Version& one) {
  json value{{"session", one.session},
             {"ended", one.ended},
             {"cell", one.cell},
             {"scope", one.workspace ? "workspace" : "near targets"},
             {"predicted_mm", one.predicted_m * kMmPerM},
             {"u95_mm", nullptr},
             {"active", one.active},
             {"trouble", nullptr},
             {"activated", nullptr}};
  if (!one.trouble.empty()) {
    value["trouble"] = one.trouble;
    value["scope"] = value["predicted_mm"] = nullptr;
  }
  if (one.in_scope) value["u95_mm"] = one.in_scope->mean_u95_m * kMmPerM;
  if (one.activated)
    value["activated"] = {{"time", one.activated->time},
                          {"who", one.activated->who},
                          {"reason", one.activated->reason}};
  return value;
}

json to_json(const calib::MovedParameter& moved) {
  return {{"name", moved.name},
          {"unit", moved.unit},
          {"before", moved.before * moved.to_unit},
          {"after", moved.after * moved.to_unit},
          {"difference", (moved.after - moved.before) * moved.to_unit},
          {"expanded", moved.expanded * moved.to_unit}};
}

json to_json(const Comparison& all) {
  json value{{"before", all.before},
             {"after", all.after},
             {"comparable", all.apart.has_value()},
             {"scope", all.workspace ? "workspace" : "near targets"},
             {"poses", nullptr},
             {"mean_mm", nullptr},
             {"max_mm", nullptr},
             {"expected_mm", nullptr},
             {"moved", json::array()},
             {"only_before", all.parameters.only_before},
             {"only_after", all.parameters.only_after},
             {"not_compared", all.parameters.not_compared}};
  if (all.apart) {
    value["poses"] = all.apart->poses;
    value["mean_mm"] = all.apart->mean_apart_m * kMmPerM;
    value["max_mm"] = all.apart->max_apart_m * kMmPerM;
  }
  if (all.expected_m > 0.0) value["expected_mm"] = all.expected_m * kMmPerM;
  for (const calib::MovedParameter& one : all.parameters.moved)
    value["moved"].push_back(to_json(one));
  return value;
}

/// {"session": 7, "reason": "why", "by": "a name"}; the name is optional, and so is the session unless
/// `needed`.
Activation wanted_in(const Request& request, bool needed) {
  const json body = calib::parse_json(request.body);
  if (!body.is_object() || !body.contains("reason") || (needed && !body.contains("session")))
    throw BadRequest(needed ? R"(the body must be {"session": 7, "reason": "why"})"
                            : R"(the body must be {"reason": "why"})");
  for (const auto& [key, value] : body.items())
    if (key != "session" && key != "reason" && key != "by")
      throw BadRequest("\"session\", \"reason\" and \"by\" are known here, not \"" +
                       printable(key) + "\"");
  Activation wanted{0, wall_clock_utc(), author_of(request, body),
                    line_in(body, "reason", kLongestReason)};
  if (body.contains("session")) {
    if (!body["session"].is_number_integer() || body["session"] < 1)
      throw BadRequest("\"session\" must be a session's number");
    body["session"].get_to(wanted.session);
  }
  return wanted;
}

Answer show_versions(Api& api, const Call& call) {
  const std::int64_t limit = whole_number_in(call.request, "limit").value_or(kUsualVersions);
  if (limit < 1 || limit > kMostVersions) throw BadRequest("\"limit\" must be 1 to 100");
  json list = json::array();
  for (const Version& one :
       versions(api.journal, whole_number_in(call.request, "session").value_or(0),
                static_cast<std::size_t>(limit)))
    list.push_back(to_json(one));
  return Response{.body = dump(list)};
}

Answer compare_versions(Api& api, const Call& call) {
  const auto before = whole_number_in(call.request, "before"),
             after = whole_number_in(call.request, "after");
  if (!before || !after) throw BadRequest("\"before\" and \"after\" must name two sessions");
  return Response{.body = dump(to_json(compare(api.journal, *before, *after)))};
}

Answer activate_version(Api& api, const Call& call) {
  const Activation wanted = wanted_in(call.request, true);
  api.service.alone("an activation", [&] { activate(api.journal, wanted); });
  spdlog::info("calibration of session {} activated by {}: {}", wanted.session, wanted.who,
               wanted.reason);
  return Response{201, "application/json", dump({{"session", wanted.session}})};
}

Answer roll_back_version(Api& api, const Call& call) {
  const Activation wanted = wanted_in(call.request, false);
  std::int64_t session = 0;
  api.service.alone("an activation",
                    [&] { session = roll_back(api.journal, wanted.session, wanted); });
  spdlog::info("rolled back to the calibration of session {} by {}: {}", session, wanted.who,
               wanted.reason);
  return Response{201, "application/json", dump({{"session", session}})};
}

// Next step to a calibrated cell, and findings of the doctor within the daemon.

json or_null(const std::string& text) { return text.empty() ? json() : json(text); }

json to_json(const StepSeen& seen, const calib::Language& language) {
  return {{"step", to_string(seen.step)},
          {"state", to_string(seen.state)},
          {"words", words(seen.words, language)},
          {"session", seen.session > 0 ? json(seen.session) : json()}};
}

/// {"cell": "/abs/cell.toml"}. Throws BadRequest.
std::filesystem::path cell_asked_for(const std::string& body) {
  const json object = calib::parse_json(body);
  if (!object.is_object() || object.size() != 1 || !object.contains("cell") ||
      !object["cell"].is_string())
    throw BadRequest("the body must be {\"cell\": \"/absolute/path.toml\"}");
  const std::string cell = object["cell"].get<std::string>();
  if (printable(cell) != cell) throw BadRequest("\"cell\" must not contain control characters");
  if (!std::filesystem::path(cell).is_absolute())
    throw RequestError("give the cell file as an absolute path, not \"" + cell + "\"");
  return cell;
}

/// Same format as `cellcal doctor --json`.
std::vector<Finding> findings_in(const json& list) try {
  std::vector<Finding> findings;
  for (const json& value : list) {
    const Finding one = finding_of(value);
    findings.push_back({printable(one.check), one.outcome, one.found, one.advice});
  }
  return findings;
} catch (const std::invalid_argument& wrong) {
  throw BadRequest(wrong.what());
}

Examiner& examiner_of(const Api& api) {
  if (api.examiner == nullptr) throw NotFound("no doctor within this daemon. Use 'cellcal doctor'");
  return *api.examiner;
}

Answer readiness(Api& api, const Call& call) {
  const calib::Language language = language_in(call.request);
  const Evidence evidence = evidence_of(examiner_of(api).newest(), api.journal);
  const std::vector<StepSeen> steps = steps_of(evidence);
  const std::optional<SetUpStep> next = next_of(steps);
  json list = json::array();
  for (const StepSeen& seen : steps) list.push_back(to_json(seen, language));
  return Response{.body = dump({{"cell", or_null(evidence.cell)},
                                {"robot", or_null(evidence.robot)},
                                {"spheres", evidence.spheres},
                                {"placed", evidence.placed},
                                {"lengths", evidence.lengths},
                                {"next", next ? json(to_string(*next)) : json()},
                                {"steps", list}})};
}

Answer doctor(Api& api, const Call& call) {
  const calib::Language language = language_in(call.request);
  const Examination newest = examiner_of(api).newest();
  json checks = json::array();
  for (const Finding& one : newest.checks) {
    json& check = checks.emplace_back(daemon::to_json(one, language));
    for (const char* key : {"found", "advice"})
      check[key] = printable(check[key].get_ref<const std::string&>());
  }
  return Response{.body = dump({{"cell", or_null(newest.cell.string())},
                                {"running", newest.running},
                                {"hint", words(newest.hint, language)},
                                {"ended", or_null(newest.ended)},
                                {"green", newest.green()},
                                {"ok", newest.count(Outcome::kOk)},
                                {"warnings", newest.count(Outcome::kWarning)},
                                {"failed", newest.count(Outcome::kFailed)},
                                {"skipped", newest.count(Outcome::kSkipped)},
                                {"checks", checks}})};
}

Answer examine(Api& api, const Call& call) {
  const std::filesystem::path cell = cell_asked_for(call.request.body);
  keep_among_cells(api, call.request, cell);
  examiner_of(api).begin(cell);
  return Response{202, "application/json", "{}"};
}

Answer adopt_examination(Api& api, const Call& call) {
  const json body = calib::parse_json(call.request.body);
  keep_among_cells(api, call.request, body.is_object() ? body.value("cell", "") : "");
  std::optional<Examiner::NotTaken> refused;
  try {
    refused = examiner_of(api).take(
        body.at("cell").get<std::string>(), body.at("cell_sha256").get<std::string>(),
        body.at("config_sha256").get<std::string>(), findings_in(body.at("checks")));
  } catch (const json::exception&) {
    throw BadRequest(
        "the body must have cell, cell_sha256, config_sha256 and checks as 'cellcal doctor' sends them");
  }
  if (!refused) return Response{.body = "{}"};
  using enum Examiner::NotTaken;
  static constexpr EnumNames<Examiner::NotTaken> kTable{
      {{kOtherConfig, "the examined configuration is not the active one"},
       {kOtherCell, "the cell file has changed since the examination, or cannot be read here"},
       {kExamining, "an examination by the daemon's doctor is in progress"}}};
  throw BusyError(kTable[*refused]);
}

}  // namespace

std::span<const Api::Route> version_routes() {
  static constexpr Api::Route kRoutes[] = {
      {"GET", "/v1/versions", Role::kView, kSlow, show_versions},
      {"GET", "/v1/versions/compare", Role::kView, kSlow, compare_versions},
      {"POST", "/v1/versions/activate", Role::kOperate, kSlow, activate_version},
      {"POST", "/v1/versions/roll-back", Role::kOperate, kSlow, roll_back_version},
      {"GET", "/v1/readiness", Role::kView, kSlow, readiness},
      {"GET", "/v1/doctor", Role::kView, kAtOnce, doctor},
      {"POST", "/v1/doctor", Role::kOperate, kSlow, examine},
      {"POST", "/v1/doctor/result", Role::kOperate, kSlow, adopt_examination},
  };
  return kRoutes;
}

}  // namespace cellcal::daemon
