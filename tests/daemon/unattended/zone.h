#pragma once
// Changes the system's time zone during its lifetime.

#include <cstdlib>
#include <ctime>
#include <optional>
#include <string>

#include "daemon/unattended/decision.h"

namespace cellcal::daemon::testing {

class Zone {
 public:
  explicit Zone(const char* name) {
    if (const char* set = std::getenv("TZ")) before_ = set;
    ::setenv("TZ", name, 1);
    ::tzset();
  }
  ~Zone() {
    if (before_) {
      ::setenv("TZ", before_->c_str(), 1);
    } else {
      ::unsetenv("TZ");
    }
    ::tzset();
  }
  Zone(const Zone&) = delete;
  Zone& operator=(const Zone&) = delete;

 private:
  std::optional<std::string> before_;
};

/// Set forward on 2026-03-29 at 02:00, back on 2026-10-25 at 03:00.
inline constexpr const char* kBerlin = "CET-1CEST,M3.5.0,M10.5.0/3";

inline constexpr UtcSeconds kHour = 3600;

}  // namespace cellcal::daemon::testing
