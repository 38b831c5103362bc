#include "calib/verdict/temperature.h"

#include <fmt/format.h>

#include <algorithm>

namespace cellcal::calib {

std::string temperature_words(std::span<const Touch> touches) {
  double coldest = 0.0, hottest = 0.0;
  std::size_t stated = 0;
  for (const Touch& touch : touches) {
    if (!touch.temperature_c) continue;
    coldest = stated == 0 ? *touch.temperature_c : std::min(coldest, *touch.temperature_c);
    hottest = stated == 0 ? *touch.temperature_c : std::max(hottest, *touch.temperature_c);
    ++stated;
  }
  if (stated == 0) return {};
  // Steel and aluminium grow by 12 and 23 um per metre and kelvin.
  return fmt::format(
      "temperature: {:.1f} to {:.1f} degrees C at {} of {} touches; it is in no model, 10 K make "
      "0.1 to 0.2 mm per metre",
      coldest, hottest, stated, touches.size());
}

}  // namespace cellcal::calib
