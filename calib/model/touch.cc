#include "calib/model/touch.h"

#include <fmt/format.h>

namespace cellcal::calib {

std::string touch_words(std::size_t index, const Touch& touch) {
  return fmt::format("touch {}{}", index + 1,
                     touch.line > 0 ? fmt::format(" (line {})", touch.line) : "");
}

}  // namespace cellcal::calib
