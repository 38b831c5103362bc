// Which step to a calibrated cell is next, and what the doctor within the daemon found.

#include <cctype>

#include "daemon/api/handlers.h"
#include "daemon/api/http/json_text.h"
#include "daemon/api/routes.h"
#include "daemon/api/run_request.h"
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

/// As `cellcal doctor --json` has it.
json to_json(const Finding& one) {
  std::string outcome = to_string(one.outcome);
  for (char& c : outcome) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return {{"check", one.check}, {"outcome", outcome}, {"found", one.found}, {"advice", one.advice}};
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

}  // namespace

Examiner& Api::examiner() {
  if (examiner_ == nullptr) throw NotFound("no doctor within this daemon. Use 'cellcal doctor'");
  return *examiner_;
}

std::optional<Response> Api::readiness(const Call&) {
  const Evidence evidence =
      evidence_of(examiner().newest(), journal_,
                  [this](std::int64_t session) { return service_.results_dir(session); });
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
  for (const Finding& one : newest.checks) checks.push_back(to_json(one));
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
  examiner().begin(cell_asked_for(call.request.body));
  return Response{202, "application/json", "{}"};
}

}  // namespace cellcal::daemon
