#include "calib/svg/text.h"

#include <cstdint>

namespace cellcal::svg {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";  // U+FFFD
constexpr std::string_view kEllipsis = "\xE2\x80\xA6";     // U+2026

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

}  // namespace cellcal::svg
