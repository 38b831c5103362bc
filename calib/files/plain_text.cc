// Tables of other programs as UTF-8 with plain line ends.

#include <fmt/format.h>

#include <algorithm>
#include <boost/locale/encoding_utf.hpp>

#include "calib/files/csv.h"
#include "calib/files/text.h"

namespace cellcal::calib {

namespace {

bool is_utf8(std::string_view text) {
  for (std::size_t at = 0; at < text.size();) {
    const CodePoint c = code_point_at(text, at);
    if (!c.valid) return false;
    at += c.length;
  }
  return true;
}

std::string from_windows_1252(std::string_view bytes, const std::string& name) {
  // Code points of 0x80 to 0x9F; 0: none.
  constexpr char16_t kHigh[32] = {0x20AC, 0,      0x201A, 0x0192, 0x201E, 0x2026, 0x2020, 0x2021,
                                  0x02C6, 0x2030, 0x0160, 0x2039, 0x0152, 0,      0x017D, 0,
                                  0,      0x2018, 0x2019, 0x201C, 0x201D, 0x2022, 0x2013, 0x2014,
                                  0x02DC, 0x2122, 0x0161, 0x203A, 0x0153, 0,      0x017E, 0x0178};
  std::string text;
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    const auto byte = static_cast<unsigned char>(bytes[at]);
    const char32_t c = byte >= 0x80 && byte < 0xA0 ? kHigh[byte - 0x80] : byte;
    if (byte != 0 && c == 0)
      throw FileError(name, ":" + std::to_string(1 + std::count(text.begin(), text.end(), '\n')) +
                                ": neither UTF-8 nor Windows-1252");
    append_utf8(c, text);
  }
  return text;
}

/// Files of other programs that hold tables.
void refuse_workbook(std::string_view bytes, const std::string& name) {
  constexpr std::pair<std::string_view, const char*> kKinds[] = {
      {"PK\x03\x04", "a ZIP archive or an Excel or OpenDocument workbook"},
      {"\xD0\xCF\x11\xE0", "an Excel workbook"},
      {"MATLAB 5.0", "a MATLAB file"},
      {"\x89HDF", "an HDF5 or MATLAB file"}};
  for (const auto& [begin, kind] : kKinds)
    if (bytes.starts_with(begin))
      throw FileError(name, fmt::format(": is {}. Save the table as CSV", kind));
}

/// Replaces all occurrences of `what`. Returns true if there were any.
bool replace_all(std::string& text, std::string_view what, char with) {
  auto at = text.find(what);
  if (at == std::string::npos) return false;
  std::string replaced;
  for (std::size_t from = 0; from < text.size(); at = text.find(what, from)) {
    replaced.append(text, from, at - from);
    if (at == std::string::npos) break;
    replaced += with;
    from = at + what.size();
  }
  text = std::move(replaced);
  return true;
}

}  // namespace

std::string plain_text(std::string_view bytes, const std::string& name,
                       std::vector<std::string>& odd) {
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  refuse_workbook(bytes, name);
  std::string text;
  if (auto decoded = from_utf16(bytes, name)) {
    text = std::move(*decoded);
    odd.emplace_back("UTF-16");
  } else if (bytes.starts_with(kMark)) {
    text = bytes.substr(kMark.size());
  } else if (is_utf8(bytes)) {
    text = bytes;
  } else {
    text = from_windows_1252(bytes, name);
    odd.emplace_back("Windows-1252");
  }
  if (text.find('\n') == std::string::npos && replace_all(text, "\r", '\n'))
    odd.emplace_back("lines that end in CR");
  if (replace_all(text, "\r\r\n", '\n')) odd.emplace_back("lines that end in CR CR LF");
  replace_all(text, "\xC2\xA0", ' ');
  replace_all(text, "\xE2\x80\xAF", ' ');
  if (replace_all(text, "\xE2\x88\x92", '-')) odd.emplace_back("Unicode minus");
  return text;
}

std::optional<std::string> from_utf16(std::string_view bytes, const std::string& name) {
  const bool little = bytes.starts_with("\xFF\xFE");
  if (!little && !bytes.starts_with("\xFE\xFF")) return std::nullopt;
  bytes.remove_prefix(2);
  std::u16string units;
  for (std::size_t at = 0; at + 1 < bytes.size(); at += 2) {
    const auto a = static_cast<unsigned char>(bytes[at]),
               b = static_cast<unsigned char>(bytes[at + 1]);
    units += static_cast<char16_t>(little ? a | b << 8 : b | a << 8);
  }
  try {
    if (bytes.size() % 2 == 0)
      return boost::locale::conv::utf_to_utf<char>(units, boost::locale::conv::stop);
  } catch (const boost::locale::conv::conversion_error&) {  // as the odd byte
  }
  throw FileError(name, ": UTF-16 text is damaged or cut off");
}

}  // namespace cellcal::calib
