#include <fmt/chrono.h>
#include <fmt/format.h>

#include <chrono>

#include "daemon/runner/backend.h"

namespace cellcal::daemon {

std::string wall_clock_utc() {
  const auto now =
      std::chrono::time_point_cast<std::chrono::milliseconds>(std::chrono::system_clock::now());
  const auto since = now.time_since_epoch().count();
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z",
                     fmt::gmtime(std::chrono::system_clock::to_time_t(now)), since % 1000);
}

}  // namespace cellcal::daemon
