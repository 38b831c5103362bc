#include "daemon/service/request.h"

#include <fmt/format.h>

#include <set>

namespace cellcal::daemon {

namespace {

constexpr int kMostTouches = 2000;
constexpr double kColdestC = -40.0, kWarmestC = 80.0;  // plausible temperatures of a robot cell
constexpr double kFinestGoalMm = 0.01, kCoarsestGoalMm = 10.0;

}  // namespace

void check(const RunRequest& request) {
  const bool checks = request.kind == SessionKind::kCheck;
  if (request.resume && request.kind != SessionKind::kCalibrate)
    throw RequestError("a session is resumed with its own kind: leave kind out");
  if (!request.resume && !(checks && request.cell.empty()) && !request.cell.is_absolute()) {
    throw RequestError("give the cell file as an absolute path, not \"" + request.cell.string() +
                       "\"");
  }
  if (const int touches = request.fit_touches.value_or(kPlannedTouches);
      touches < 4 || touches > kMostTouches) {
    throw RequestError("touches (fit) must be 4 to 2000, not " + std::to_string(touches));
  }
  if (request.goal_mm &&
      !(*request.goal_mm >= kFinestGoalMm && *request.goal_mm <= kCoarsestGoalMm)) {
    throw RequestError(fmt::format("the goal must be {} to {} mm, not {}", kFinestGoalMm,
                                   kCoarsestGoalMm, *request.goal_mm));
  }
  if (request.kind == SessionKind::kQualify &&
      (request.goal_mm || request.find || request.fit_touches))
    throw RequestError("a qualification has its own touches: leave goal_mm, find and touches out");
  if (checks && (request.goal_mm || request.find || request.fit_touches))
    throw RequestError("a check has its own touches: leave goal_mm, find and touches out");
  if ((checks || request.update) && request.seed != RunRequest{}.seed)
    throw RequestError("checks are compared by the same touches: leave seed out");
  if (request.kind == SessionKind::kFind && (request.goal_mm || request.fit_touches))
    throw RequestError("finding ends when all spheres are found: leave goal_mm and touches out");
  if (request.kind == SessionKind::kDryRun && (request.goal_mm || request.find))
    throw RequestError(
        "a dry run follows a planned path: leave goal_mm and find out, and give "
        "touches");
  if (request.update && request.kind != SessionKind::kCalibrate)
    throw RequestError(
        "\"update\" applies to a calibration: leave it out of a check or qualification");
  if (request.resume && !request.load.empty())
    throw RequestError("a resumed session keeps its load: leave \"load\" out");
  if (request.update && request.resume)
    throw RequestError("an update is not resumed: start a new one, without \"resume\"");
  if (request.update && (request.goal_mm || request.find || request.fit_touches))
    throw RequestError("an update has its own touches: leave goal_mm, find and touches out");
  if (!checks && request.calibration)
    throw RequestError(
        "\"calibration\" applies to a check: a calibration begins from the files alone");
  if (!checks && !request.mastered.empty())
    throw RequestError("\"mastered\" applies to a check: leave it out");
  if (std::set(request.mastered.begin(), request.mastered.end()).size() != request.mastered.size())
    throw RequestError("\"mastered\" names a joint twice");
  if (!checks && request.temperature_c)
    throw RequestError("\"temperature_c\" applies to a check: leave it out");
  if (request.temperature_c &&
      !(*request.temperature_c >= kColdestC && *request.temperature_c <= kWarmestC))
    throw RequestError(fmt::format("temperature_c must be {} to {} degrees Celsius, not {}",
                                   kColdestC, kWarmestC, *request.temperature_c));
  if (request.kind != SessionKind::kQualify && !request.target.empty())
    throw RequestError("\"target\" applies to a qualification: a calibration touches all targets");
  if (request.check_touches < 0 || request.check_touches > kMostTouches) {
    throw RequestError("check touches must be 0 to 2000, not " +
                       std::to_string(request.check_touches));
  }
}

}  // namespace cellcal::daemon
