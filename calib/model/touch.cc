#include "calib/model/touch.h"

#include <fmt/format.h>

#include <stdexcept>

#include "calib/model/robot.h"

namespace cellcal::calib {

const char* to_string(TouchSet set) { return set == TouchSet::kFit ? "fit" : "check"; }

std::span<const double> carrier_rad(const Touch& touch, const Target& target) {
  const auto axes = static_cast<std::size_t>(target.carried_by);
  if (touch.positioner_rad.size() < axes)
    throw std::invalid_argument("touch of " + touch.target +
                                ": the positioner's angles are missing");
  return std::span(touch.positioner_rad).first(axes);
}

std::span<const double> outer_rad(const Touch& touch, const Target& target) {
  return std::span(touch.positioner_rad).subspan(carrier_rad(touch, target).size());
}

std::string touch_words(std::size_t index, const Touch& touch) {
  return fmt::format("touch {}{}", index + 1,
                     touch.line > 0 ? fmt::format(" (line {})", touch.line) : "");
}

}  // namespace cellcal::calib
