#include "daemon/report/drawing/text.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>

#include "calib/model/units.h"

namespace cellcal::daemon::report {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";  // U+FFFD
constexpr std::string_view kMinus = "\xE2\x88\x92";        // U+2212
constexpr std::string_view kDash = "\xE2\x80\x93";         // U+2013
constexpr std::string_view kEllipsis = "\xE2\x80\xA6";     // U+2026
constexpr double kTooLargeForFixed = 1e9;

struct CodePoint {
  std::uint32_t value = 0;
  std::size_t length = 1;  // bytes used
  bool valid = false;
};

bool is_continuation(unsigned char byte) { return (byte & 0xC0U) == 0x80U; }

// RFC 3629: shortest form only, no surrogates, nothing above U+10FFFF.
CodePoint decode(std::string_view text, std::size_t at) {
  const auto lead = static_cast<unsigned char>(text[at]);
  if (lead < 0x80U) return {lead, 1, true};
  std::size_t length = 0;
  std::uint32_t value = 0;
  std::uint32_t least = 0;
  if ((lead & 0xE0U) == 0xC0U) {
    length = 2, value = lead & 0x1FU, least = 0x80;
  } else if ((lead & 0xF0U) == 0xE0U) {
    length = 3, value = lead & 0x0FU, least = 0x800;
  } else if ((lead & 0xF8U) == 0xF0U) {
    length = 4, value = lead & 0x07U, least = 0x10000;
  } else {
    return {};
  }
  if (at + length > text.size()) return {};
  for (std::size_t i = 1; i < length; ++i) {
    const auto byte = static_cast<unsigned char>(text[at + i]);
    if (!is_continuation(byte)) return {};
    value = (value << 6U) | (byte & 0x3FU);
  }
  const bool surrogate = value >= 0xD800 && value <= 0xDFFF;
  if (value < least || value > 0x10FFFF || surrogate) return {};
  return {value, length, true};
}

bool belongs_in_a_document(std::uint32_t value) {
  if (value == '\n' || value == '\t') return true;
  if (value < 0x20 || (value >= 0x7F && value < 0xA0)) return false;
  // Bidirectional marks, embeddings, overrides and isolates; see Unicode TR 36.
  if (value == 0x061C || value == 0x200E || value == 0x200F) return false;
  if (value >= 0x202A && value <= 0x202E) return false;
  if (value >= 0x2066 && value <= 0x2069) return false;
  return value != 0xFFFE && value != 0xFFFF;
}

std::string with_real_minus(std::string_view text) {
  std::string out;
  out.reserve(text.size() + kMinus.size());
  for (const char c : text) {
    if (c == '-') {
      out += kMinus;
    } else {
      out += c;
    }
  }
  return out;
}

}  // namespace

std::string escape(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t at = 0; at < text.size();) {
    const CodePoint point = decode(text, at);
    if (!point.valid || !belongs_in_a_document(point.value)) {
      out += kReplacement;
    } else if (point.value == '&') {
      out += "&amp;";
    } else if (point.value == '<') {
      out += "&lt;";
    } else if (point.value == '>') {
      out += "&gt;";
    } else if (point.value == '"') {
      out += "&quot;";
    } else if (point.value == '\'') {
      out += "&#39;";
    } else {
      out += text.substr(at, point.length);
    }
    at += point.length;
  }
  return out;
}

std::string shorten(std::string_view text, std::size_t code_points) {
  std::size_t count = 0;
  std::size_t cut = 0;  // where the text ends if an ellipsis follows
  for (std::size_t at = 0; at < text.size(); at += decode(text, at).length) {
    if (count + 1 == code_points) cut = at;
    if (++count > code_points) return std::string(text.substr(0, cut)).append(kEllipsis);
  }
  return std::string(text);
}

std::string ascii_fixed(double value, int decimals) {
  if (!std::isfinite(value)) return std::string(kDash);
  if (std::abs(value) >= kTooLargeForFixed) return fmt::format("{:.{}e}", value, decimals);
  std::string text = fmt::format("{:.{}f}", value, decimals);
  if (text.front() == '-' && text.find_first_of("123456789") == std::string::npos) text.erase(0, 1);
  return text;
}

std::string fixed(double value, int decimals) {
  return with_real_minus(ascii_fixed(value, decimals));
}

std::string signed_fixed(double value, int decimals) {
  const std::string text = ascii_fixed(value, decimals);
  const bool plus = std::isfinite(value) && text.front() != '-' &&
                    text.find_first_of("123456789") != std::string::npos;
  return plus ? fmt::format("+{}", text) : with_real_minus(text);
}

std::string significant(double value, int digits) {
  if (!std::isfinite(value)) return std::string(kDash);
  if (value == 0.0) return "0";
  return with_real_minus(fmt::format("{:.{}g}", value, digits));
}

std::string mm(double metres, int decimals) { return fixed(metres * calib::kMmPerM, decimals); }

std::string signed_mm(double metres, int decimals) {
  return signed_fixed(metres * calib::kMmPerM, decimals);
}

std::string positive_mm(double metres, int decimals) {
  return metres > 0.0 ? mm(metres, decimals) : std::string(kDash);
}

std::string mm_words(double metres) { return mm(metres) + "\xC2\xA0mm"; }

std::string readable_time(std::string_view iso) {
  constexpr std::string_view kPattern = "dddd-dd-ddTdd:dd:dd";
  bool matches = iso.size() > kPattern.size() && iso.back() == 'Z';
  for (std::size_t i = 0; matches && i < kPattern.size(); ++i) {
    const bool digit = iso[i] >= '0' && iso[i] <= '9';
    matches = kPattern[i] == 'd' ? digit : iso[i] == kPattern[i];
  }
  // Between the seconds and the Z at most a fraction, which nobody reads.
  const std::string_view rest = matches ? iso.substr(kPattern.size()) : std::string_view();
  matches =
      matches && (rest.size() == 1 || rest[0] == '.') &&
      rest.substr(0, rest.size() - 1).find_first_not_of(".0123456789") == std::string_view::npos;
  if (!matches) return std::string(iso);
  return fmt::format("{} {} UTC", iso.substr(0, 10), iso.substr(11, 8));
}

std::string counted(std::size_t count, std::string_view one, std::string_view many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

}  // namespace cellcal::daemon::report
