#include "daemon/service/request.h"

#include <fmt/format.h>

#include <set>

#include "daemon/service/kind.h"

namespace cellcal::daemon {

namespace {

constexpr int kMostTouches = 2000;
constexpr double kColdestC = -40.0, kWarmestC = 80.0;  // plausible temperatures of a robot cell
constexpr double kFinestGoalMm = 0.01, kCoarsestGoalMm = 10.0;

}  // namespace

void check(const RunRequest& request) {
  const Kind::Parameters takes = kind_of(request.kind, request.update).parameters();
  if (request.resume && request.kind != SessionKind::kCalibrate)
    throw RequestError("a session is resumed with its own kind: leave kind out");
  const bool of_a_calibration = takes.compares && request.cell.empty();
  if (!request.resume && !of_a_calibration && !request.cell.is_absolute()) {
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
  if (request.update && request.kind != SessionKind::kCalibrate)
    throw RequestError(
        "\"update\" applies to a calibration: leave it out of a check or qualification");
  if (request.resume && !request.load.empty())
    throw RequestError("a resumed session keeps its load: leave \"load\" out");
  if (request.update && request.resume)
    throw RequestError("an update is not resumed: start a new one, without \"resume\"");
  if ((request.goal_mm && !takes.goal) || (request.find && !takes.find) ||
      (request.fit_touches && !takes.touches))
    throw RequestError(takes.refusal);
  if (request.seed != RunRequest{}.seed && !takes.seed)
    throw RequestError("checks are compared by the same touches: leave seed out");
  if (!takes.compares && request.calibration)
    throw RequestError(
        "\"calibration\" applies to a check: a calibration begins from the files alone");
  if (!takes.compares && !request.mastered.empty())
    throw RequestError("\"mastered\" applies to a check: leave it out");
  if (std::set(request.mastered.begin(), request.mastered.end()).size() != request.mastered.size())
    throw RequestError("\"mastered\" names a joint twice");
  if (!takes.compares && request.temperature_c)
    throw RequestError("\"temperature_c\" applies to a check: leave it out");
  if (request.temperature_c &&
      !(*request.temperature_c >= kColdestC && *request.temperature_c <= kWarmestC))
    throw RequestError(fmt::format("temperature_c must be {} to {} degrees Celsius, not {}",
                                   kColdestC, kWarmestC, *request.temperature_c));
  if (!takes.target && !request.target.empty())
    throw RequestError("\"target\" applies to a qualification: a calibration touches all targets");
  if (request.check_touches < 0 || request.check_touches > kMostTouches) {
    throw RequestError("check touches must be 0 to 2000, not " +
                       std::to_string(request.check_touches));
  }
}

}  // namespace cellcal::daemon
