#pragma once

#include <string>
#include <string_view>

namespace cellcal::calib {

/// Whether a control character is in it, ASCII's or (in UTF-8) one of U+0080 to U+009F.
inline bool has_control(std::string_view text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    if (byte < 0x20 || byte == 0x7f) return true;
    if (byte == 0xc2 && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xa0)
      return true;
  }
  return false;
}

/// Its first `most` bytes, or up to three fewer: no character of UTF-8 is cut in two. What is no UTF-8 is cut where it must.
inline std::string_view beginning(std::string_view text, std::size_t most) {
  if (text.size() <= most) return text;
  constexpr std::size_t kLongestCharacter = 4;
  const auto goes_on = [&](std::size_t i) {
    return (static_cast<unsigned char>(text[i]) & 0xc0) == 0x80;
  };
  std::size_t end = most;
  while (end > 0 && most - end < kLongestCharacter && goes_on(end)) --end;
  return text.substr(0, goes_on(end) ? most : end);
}

/// Foreign text as it may stand in a message: bounded, and without control characters, which could
/// steer the terminal or forge a line of a log.
inline std::string shown(std::string_view text, std::size_t most = 40) {
  std::string out;
  for (const char c : beginning(text, most))
    out += (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) ? '?' : c;
  return text.size() > most ? out + "..." : out;
}

}  // namespace cellcal::calib
