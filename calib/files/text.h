#pragma once

#include <algorithm>
#include <boost/locale/utf.hpp>
#include <iterator>
#include <string>
#include <string_view>

namespace cellcal::calib {

/// In UTF-8.
inline void append_utf8(char32_t c, std::string& text) {
  boost::locale::utf::utf_traits<char>::encode(c, std::back_inserter(text));
}

struct CodePoint {
  char32_t value = 0;
  std::size_t length = 1;  ///< bytes
  bool valid = false;      ///< as RFC 3629: shortest form, no surrogates, up to U+10FFFF
};
inline CodePoint code_point_at(std::string_view text, std::size_t at) {
  using namespace boost::locale::utf;
  const char* end = text.data() + at;
  const code_point c = utf_traits<char>::decode(end, text.data() + text.size());
  if (c == illegal || c == incomplete) return {};
  return {c, static_cast<std::size_t>(end - text.data()) - at, true};
}

// Letters: ASCII.

inline char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

inline std::string lower_case(std::string_view text) {
  std::string result(text);
  std::ranges::transform(text, result.begin(), lower);
  return result;
}

inline bool same_letters(std::string_view a, std::string_view b) {
  return std::ranges::equal(a, b, {}, lower, lower);
}

/// Length in bytes of the control character at `i`, 0 if there is none: ASCII, U+0080 to U+009F, and Unicode's
/// direction marks and line separators (UTF-8), which can make one name look like another.
inline std::size_t control_at(std::string_view text, std::size_t i) {
  const auto byte = [&](std::size_t k) {
    return i + k < text.size() ? static_cast<unsigned char>(text[i + k]) : 0u;
  };
  if (byte(0) < 0x20 || byte(0) == 0x7f) return 1;
  if (byte(0) == 0xc2 && byte(1) >= 0x80 && byte(1) < 0xa0) return 2;
  if (byte(0) == 0xd8 && byte(1) == 0x9c) return 2;  // U+061C
  if (byte(0) != 0xe2) return 0;
  const bool marks = byte(1) == 0x80 &&
                     (byte(2) == 0x8e || byte(2) == 0x8f || (byte(2) >= 0xa8 && byte(2) <= 0xae));
  const bool isolates = byte(1) == 0x81 && byte(2) >= 0xa6 && byte(2) <= 0xa9;
  return marks || isolates ? 3 : 0;
}

inline bool has_control(std::string_view text) {
  for (std::size_t i = 0; i < text.size(); ++i)
    if (control_at(text, i) > 0) return true;
  return false;
}

/// The first `most` bytes, or up to three fewer so that no UTF-8 character is split. Invalid UTF-8 is cut at `most`.
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

/// Untrusted text for a message: bounded, and without control characters, which could steer the
/// terminal or forge a line of a log.
inline std::string shown(std::string_view text, std::size_t most = 40) {
  std::string out;
  const std::string_view part = beginning(text, most);
  for (std::size_t i = 0; i < part.size();) {
    const std::size_t control = control_at(part, i);
    out += control > 0 ? '?' : part[i];
    i += control > 0 ? control : 1;
  }
  return text.size() > most ? out + "..." : out;
}

inline constexpr std::string_view kBlanks = " \t\r\n";

/// Without leading and trailing whitespace.
inline std::string_view trimmed(std::string_view text, std::string_view blanks = kBlanks) {
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

}  // namespace cellcal::calib
