#include "drivers/kuka/krl/krl_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace cellcal::drivers::krl {

namespace {

bool names_a_place(char c) { return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_'; }

/// Length of the placeholder at the start of the text, including both signs; 0: none.
std::size_t place_size(std::string_view text) {
  if (text.size() < 3 || text[0] != '@') return 0;
  std::size_t end = 1;
  while (end < text.size() && names_a_place(text[end])) ++end;
  return end > 1 && end < text.size() && text[end] == '@' ? end + 1 : 0;
}

std::string filled_line(std::string_view line, const Places& places) {
  std::string result;
  while (!line.empty()) {
    const std::size_t size = place_size(line);
    if (size == 0) {
      result += line.front();
      line.remove_prefix(1);
      continue;
    }
    const std::string_view name = line.substr(1, size - 2);
    const auto found = places.find(name);
    if (found == places.end()) {
      throw std::logic_error("controller file template: nothing for the place " +
                             std::string(name));
    }
    result += found->second;
    line.remove_prefix(size);
  }
  return result;
}

}  // namespace

std::string fill(std::string_view text, const Places& places) {
  std::string result;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::string filled = filled_line(line, places);
    if (filled.empty() && !line.empty()) continue;
    for (const char c : filled + '\n') {
      if (c == '\n') result += '\r';
      result += c;
    }
  }
  return result;
}

std::string decimal(double value) {
  const std::string text = fmt::to_string(value);
  return text.find('.') == std::string::npos ? text + ".0" : text;
}

}  // namespace cellcal::drivers::krl
