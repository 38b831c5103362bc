#include "daemon/doctor/finding.h"

#include <algorithm>

namespace cellcal::daemon {

const char* to_string(Outcome outcome) {
  switch (outcome) {
    case Outcome::kOk:
      return "ok";
    case Outcome::kWarning:
      return "warning";
    case Outcome::kFailed:
      return "FAILED";
    case Outcome::kSkipped:
      return "skipped";
  }
  return "unknown";
}

void Findings::ok(const std::string& check, const std::string& found) {
  add({check, Outcome::kOk, found, ""});
}

void Findings::warn(const std::string& check, const std::string& found, const std::string& advice) {
  add({check, Outcome::kWarning, found, advice});
}

void Findings::fail(const std::string& check, const std::string& found, const std::string& advice) {
  add({check, Outcome::kFailed, found, advice});
}

void Findings::skip(const std::string& check, const std::string& why) {
  add({check, Outcome::kSkipped, why, ""});
}

std::size_t Findings::count(Outcome outcome) const {
  return static_cast<std::size_t>(std::count_if(
      all_.begin(), all_.end(), [outcome](const Finding& one) { return one.outcome == outcome; }));
}

void Findings::add(Finding finding) {
  all_.push_back(std::move(finding));
  if (listener_) listener_(all_.back());
}

}  // namespace cellcal::daemon
