#include <chrono>

#include "calib/model/iso_time.h"
#include "daemon/runner/backend.h"

namespace cellcal::daemon {

std::string wall_clock_utc() {
  return calib::utc_text(
      std::chrono::floor<std::chrono::milliseconds>(std::chrono::system_clock::now()));
}

}  // namespace cellcal::daemon
