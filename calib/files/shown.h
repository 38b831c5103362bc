#pragma once

#include <string>
#include <string_view>

namespace cellcal::calib {

/// Foreign text as it may stand in a message: bounded, and without control characters, which could
/// steer the terminal or forge a line of a log.
inline std::string shown(std::string_view text, std::size_t most = 40) {
  std::string out;
  for (const char c : text.substr(0, most))
    out += (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) ? '?' : c;
  return text.size() > most ? out + "..." : out;
}

}  // namespace cellcal::calib
