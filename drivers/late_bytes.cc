#include "drivers/late_bytes.h"

#include <fmt/format.h>

namespace cellcal::drivers {

std::string late_bytes_words(double late_s, double limit_s) {
  constexpr double kMs = 1e3;
  return fmt::format(
      "contact sensor's bytes {:.0f} ms late on this computer (limit {:.0f} ms), sent in time by "
      "the sensor. Stop other programs on this computer, or reserve a core "
      "(drivers/contact/README.md)",
      kMs * late_s, kMs * limit_s);
}

}  // namespace cellcal::drivers
