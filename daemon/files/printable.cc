#include "daemon/files/printable.h"

#include <cstddef>

#include "calib/files/text.h"

namespace cellcal::daemon {

std::string printable(std::string_view text) {
  std::string line(text);
  for (std::size_t i = 0; i < line.size(); ++i)
    for (std::size_t left = calib::control_at(text, i); left > 0; --left) line[i + left - 1] = ' ';
  return line;
}

}  // namespace cellcal::daemon
