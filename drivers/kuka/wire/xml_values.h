#pragma once
// Numbers and names of KUKA's XML, both ways: locale-independent, finite, case-insensitive; values without
// allocation.

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace cellcal::drivers::wire {

inline constexpr std::size_t kAxesPerElement = 6;
/// Attributes of a position and its orientation.
inline constexpr std::string_view kFrameNames = "XYZABC";

inline char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

inline std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = lower(c);
  return result;
}

inline bool same_name(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (lower(a[i]) != lower(b[i])) return false;
  }
  return true;
}

/// Beginning of damaged input for display: printable characters, others as dots.
template <std::size_t N>
void show(std::string_view bytes, char (&text)[N]) {
  const std::size_t shown = std::min(bytes.size(), N - 1);
  for (std::size_t i = 0; i < shown; ++i) {
    text[i] = bytes[i] >= ' ' && bytes[i] <= '~' ? bytes[i] : '.';
  }
  text[shown] = '\0';
}

inline std::string_view trim(std::string_view text) {
  constexpr std::string_view kSpace = " \t\r\n";
  const auto first = text.find_first_not_of(kSpace);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kSpace) - first + 1);
}

inline bool parse_number(std::string_view text, double& value) {
  text = trim(text);
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
}

/// An angle [deg] or a length [mm]. The limit is far above any measured value of a robot.
inline bool parse_measure(std::string_view text, double& value) {
  constexpr double kMost = 1e6;
  return parse_number(text, value) && std::abs(value) <= kMost;
}

// Significant digits after the decimal point: 1.25E-3 has five.
inline int count_decimals(std::string_view text) {
  text = trim(text);
  const auto exponent_at = text.find_first_of("eE");
  int exponent = 0;
  if (exponent_at != std::string_view::npos) {
    std::string_view digits = text.substr(exponent_at + 1);
    if (!digits.empty() && digits.front() == '+') digits.remove_prefix(1);
    std::from_chars(digits.data(), digits.data() + digits.size(), exponent);
    text = text.substr(0, exponent_at);
  }
  const auto point = text.find('.');
  const int behind =
      point == std::string_view::npos ? 0 : static_cast<int>(text.size() - point - 1);
  constexpr int kLargestExponent = 400;  // beyond a double's; keeps the difference an int
  return std::max(0, behind - std::clamp(exponent, -kLargestExponent, kLargestExponent));
}

// Appends to a fixed buffer; on overflow the whole text is discarded.
class Writer {
 public:
  explicit Writer(std::span<char> buffer)
      : begin_(buffer.data()), at_(begin_), end_(begin_ + buffer.size()) {}

  Writer& put(std::string_view text) {
    if (static_cast<std::size_t>(end_ - at_) < text.size()) {
      full_ = true;
      return *this;
    }
    text.copy(at_, text.size());
    at_ += text.size();
    return *this;
  }

  Writer& put(double value, int decimals) {
    // Avoids "-0.0000", whose sign some readers take for a movement.
    if (std::abs(value) < 0.5 * std::pow(10.0, -decimals)) value = 0.0;
    return number(std::to_chars(at_, end_, value, std::chars_format::fixed, decimals));
  }

  Writer& put(std::uint64_t value) { return number(std::to_chars(at_, end_, value)); }

  /// <NAME L1="..." L2="..."/>
  Writer& element(std::string_view name, char letter, std::span<const double> values,
                  int decimals) {
    put("<").put(name);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const char attribute[] = {' ', letter, static_cast<char>('1' + i), '=', '"'};
      put({attribute, sizeof attribute}).put(values[i], decimals).put("\"");
    }
    return put("/>");
  }

  /// <NAME X="..." ... C="..."/>: as many as there are values.
  Writer& frame(std::string_view name, std::span<const double> values, int decimals) {
    put("<").put(name);
    for (std::size_t i = 0; i < std::min(values.size(), kFrameNames.size()); ++i) {
      put(" ").put(kFrameNames.substr(i, 1)).put("=\"").put(values[i], decimals).put("\"");
    }
    return put("/>");
  }

  std::string_view text() const {
    if (full_) return {};
    return {begin_, static_cast<std::size_t>(at_ - begin_)};
  }

 private:
  Writer& number(std::to_chars_result result) {
    if (result.ec != std::errc()) {
      full_ = true;
    } else {
      at_ = result.ptr;
    }
    return *this;
  }

  char* begin_;
  char* at_;
  char* end_;
  bool full_ = false;
};

}  // namespace cellcal::drivers::wire
