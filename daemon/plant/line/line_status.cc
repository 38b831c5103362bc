#include "daemon/plant/line/line_status.h"

namespace cellcal::daemon::plant {

const std::vector<std::pair<LineProblem, const char*>>& line_problems() {
  static const std::vector<std::pair<LineProblem, const char*>> kAll{
      {LineProblem::kNone, "none"},
      {LineProblem::kNotRunning, "not-running"},
      {LineProblem::kFiles, "files"},
      {LineProblem::kNoName, "no-name"},
      {LineProblem::kUnreachable, "unreachable"},
      {LineProblem::kCertificate, "certificate"},
      {LineProblem::kLogin, "login"},
      {LineProblem::kRefused, "refused"},
      {LineProblem::kTooLarge, "too-large"},
      {LineProblem::kNobody, "nobody-collects"},
      {LineProblem::kTakenOver, "taken-over"},
      {LineProblem::kUnstored, "not-stored"},
      {LineProblem::kRenamed, "renamed"},
      {LineProblem::kLost, "lost"},
      {LineProblem::kJournal, "journal"}};
  return kAll;
}

const char* to_string(LineProblem problem) {
  for (const auto& [one, name] : line_problems())
    if (one == problem) return name;
  return "none";
}

}  // namespace cellcal::daemon::plant
