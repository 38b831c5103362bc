#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "drivers/error.h"
#include "drivers/kuka/krl/krl_template.h"

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

/// Name of the list that the line is repeated for; none: once.
std::optional<std::string_view> list_of(std::string_view line) {
  if (!line.starts_with("@*")) return std::nullopt;
  return line.substr(2, line.find('@', 2) - 2);
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

void add_line(std::string_view line, const Places& places, std::string& text) {
  const std::string filled = filled_line(line, places);
  if (filled.empty() && !line.empty()) return;
  for (const char c : filled + '\n') {
    if (c == '\n') text += '\r';
    text += c;
  }
}

}  // namespace

std::string fill(std::string_view text, const Places& places, const Lists& lists) {
  std::string result;
  std::string_view list;
  std::vector<std::string_view> block;  // lines of the list
  const auto repeat_block = [&] {
    if (block.empty()) return;
    const auto items = lists.find(list);
    if (items == lists.end())
      throw std::logic_error("controller file template: no list " + std::string(list));
    for (Places item : items->second) {
      item.insert(places.begin(), places.end());
      for (const std::string_view line : block) add_line(line, item, result);
    }
    block.clear();
  };
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const auto name = list_of(line);
    if (name.value_or("") != list) repeat_block();
    list = name.value_or("");
    if (!name) add_line(line, places, result);
    if (!list.empty()) block.push_back(line.substr(list.size() + 3));
  }
  repeat_block();
  return result;
}

std::string fill(std::string_view text, const Places& places) { return fill(text, places, {}); }

std::string part(std::string_view name, const Places& places, const Lists& lists) {
  std::string text = fill(template_text(name), places, lists);
  std::erase(text, '\r');
  if (!text.empty()) text.pop_back();
  return text;
}

void check_range(const char* key, double value, double low, double high) {
  if (!(value >= low && value <= high))
    throw ConfigError(
        fmt::format("controller files: {} = {} is outside {}..{}", key, value, low, high));
}

std::string frame_value(const char* array, int number) {
  return number == 0 ? "$NULLFRAME" : fmt::format("{}[{}]", array, number);
}

std::string load_value(int number) {
  return number == 0 ? "{M -1.0,CM {X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0},J {X 0.0,Y 0.0,Z 0.0}}"
                     : fmt::format("LOAD_DATA[{}]", number);
}

std::string decimal(double value) {
  const std::string text = fmt::to_string(value);
  return text.find('.') == std::string::npos ? text + ".0" : text;
}

}  // namespace cellcal::drivers::krl
