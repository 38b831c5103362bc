#include "daemon/files/printable.h"

#include <cstddef>

namespace cellcal::daemon {

std::string printable(std::string_view text) {
  std::string line(text);
  for (std::size_t i = 0; i < line.size(); ++i) {
    const auto c = static_cast<unsigned char>(line[i]);
    const auto next = static_cast<unsigned char>(i + 1 < line.size() ? line[i + 1] : '\0');
    if (c < 0x20 || c == 0x7f) line[i] = ' ';
    if (c == 0xC2 && next >= 0x80 && next < 0xA0) line[i] = line[i + 1] = ' ';
  }
  return line;
}

}  // namespace cellcal::daemon
