#include "calib/model/touch.h"

#include <fmt/format.h>

namespace cellcal::calib {

const char* to_string(TouchSet set) { return set == TouchSet::kFit ? "fit" : "check"; }

std::string touch_words(std::size_t index, const Touch& touch) {
  return fmt::format("touch {}{}", index + 1,
                     touch.line > 0 ? fmt::format(" (line {})", touch.line) : "");
}

}  // namespace cellcal::calib
