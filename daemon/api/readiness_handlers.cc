// Which step to a calibrated cell is next, and what the doctor within the daemon found.

#include "daemon/api/handlers.h"
#include "daemon/api/http/json_text.h"
#include "daemon/api/routes.h"
#include "daemon/files/printable.h"
#include "daemon/readiness/evidence.h"
#include "daemon/readiness/examiner.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

json or_null(const std::string& text) { return text.empty() ? json() : json(text); }

json to_json(const StepSeen& seen) {
  return {{"step", to_string(seen.step)},
          {"state", to_string(seen.state)},
          {"words", seen.words},
          {"session", seen.session > 0 ? json(seen.session) : json()}};
}

/// {"cell": "/abs/cell.toml"}. Throws BadRequest.
std::filesystem::path cell_asked_for(const std::string& body) {
  const json object = json::parse(body, nullptr, false);
  if (!object.is_object() || object.size() != 1 || !object.contains("cell") ||
      !object["cell"].is_string())
    throw BadRequest("the body must be {\"cell\": \"/absolute/path.toml\"}");
  const std::string cell = object["cell"].get<std::string>();
  if (printable(cell) != cell) throw BadRequest("\"cell\" must not contain control characters");
  if (!std::filesystem::path(cell).is_absolute())
    throw RequestError("give the cell file as an absolute path, not \"" + cell + "\"");
  return cell;
}

/// As `cellcal doctor --json` has them.
std::vector<Finding> findings_in(const json& list) try {
  std::vector<Finding> findings;
  for (const json& value : list) {
    const Finding one = finding_of(value);
    findings.push_back(
        {printable(one.check), one.outcome, printable(one.found), printable(one.advice)});
  }
  return findings;
} catch (const std::invalid_argument& wrong) {
  throw BadRequest(wrong.what());
}

}  // namespace

Examiner& Api::examiner() {
  if (examiner_ == nullptr) throw NotFound("no doctor within this daemon. Use 'cellcal doctor'");
  return *examiner_;
}

std::optional<Response> Api::readiness(const Call&) {
  const Evidence evidence = evidence_of(examiner().newest(), journal_);
  const std::vector<StepSeen> steps = steps_of(evidence);
  const std::optional<SetUpStep> next = next_of(steps);
  json list = json::array();
  for (const StepSeen& seen : steps) list.push_back(to_json(seen));
  return Response{.body = dump({{"cell", or_null(evidence.cell)},
                                {"robot", or_null(evidence.robot)},
                                {"spheres", evidence.spheres},
                                {"placed", evidence.placed},
                                {"lengths", evidence.lengths},
                                {"next", next ? json(to_string(*next)) : json()},
                                {"steps", list}})};
}

std::optional<Response> Api::doctor(const Call&) {
  const Examination newest = examiner().newest();
  json checks = json::array();
  for (const Finding& one : newest.checks) checks.push_back(daemon::to_json(one));
  return Response{.body = dump({{"cell", or_null(newest.cell.string())},
                                {"running", newest.running},
                                {"hint", newest.hint},
                                {"ended", or_null(newest.ended)},
                                {"green", newest.green()},
                                {"ok", newest.count(Outcome::kOk)},
                                {"warnings", newest.count(Outcome::kWarning)},
                                {"failed", newest.count(Outcome::kFailed)},
                                {"skipped", newest.count(Outcome::kSkipped)},
                                {"checks", checks}})};
}

std::optional<Response> Api::examine(const Call& call) {
  const std::filesystem::path cell = cell_asked_for(call.request.body);
  keep_among_cells(call.request, cell);
  examiner().begin(cell);
  return Response{202, "application/json", "{}"};
}

std::optional<Response> Api::take_examination(const Call& call) {
  const json body = json::parse(call.request.body, nullptr, false);
  keep_among_cells(call.request, body.is_object() ? body.value("cell", "") : "");
  std::optional<Examiner::NotTaken> refused;
  try {
    refused = examiner().take(
        body.at("cell").get<std::string>(), body.at("cell_sha256").get<std::string>(),
        body.at("config_sha256").get<std::string>(), findings_in(body.at("checks")));
  } catch (const json::exception&) {
    throw BadRequest(
        "the body must have cell, cell_sha256, config_sha256 and checks as 'cellcal doctor' sends them");
  }
  if (!refused) return Response{.body = "{}"};
  switch (*refused) {
    case Examiner::NotTaken::kOtherConfig:
      throw BusyError("the configuration that was looked at is not the one in force here");
    case Examiner::NotTaken::kOtherCell:
      throw BusyError("the cell file has changed since it was looked at, or cannot be read here");
    case Examiner::NotTaken::kLooking:
      break;
  }
  throw BusyError("the doctor within the daemon is looking");
}

}  // namespace cellcal::daemon
