#include "drivers/late_bytes.h"

#include <fmt/format.h>

namespace cellcal::drivers {

std::string late_bytes_words(double late_s, double limit_s) {
  constexpr double kMs = 1e3;
  // Those that come every 10 ms are late by less than the time in which none arrived.
  const std::string limit = late_s > limit_s
                                ? fmt::format("limit {:.0f} ms", kMs * limit_s)
                                : fmt::format("none arrived within {:.0f} ms", kMs * limit_s);
  return fmt::format(
      "contact sensor's bytes {:.0f} ms late on this computer ({}), sent in time by the sensor. "
      "Stop other programs on this computer, or reserve a core (drivers/contact/README.md)",
      kMs * late_s, limit);
}

}  // namespace cellcal::drivers
