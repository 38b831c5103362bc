#include "drivers/kuka/krl/krl_xml.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "drivers/error.h"
#include "drivers/kuka/krl/krl_read.h"
#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers::krl {
namespace {

bool is_utf16(std::string_view text) {
  return text.substr(0, 2) == "\xFF\xFE" || text.substr(0, 2) == "\xFE\xFF" ||
         text.substr(0, 200).find('\0') != std::string_view::npos;
}

}  // namespace

XmlText::XmlText(std::string_view text, std::string name) : name_(std::move(name)), text_(text) {
  if (text_.size() > kMostFile) {
    throw ConfigError(fmt::format("{}: {} bytes, a controller's file has at most {}", name_,
                                  text_.size(), kMostFile));
  }
  if (is_utf16(text_)) {
    throw ConfigError(name_ + ":1: not UTF-8 text. Save it as UTF-8");
  }
  for (std::size_t at = text_.find('\n'); at != std::string::npos; at = text_.find('\n', at + 1))
    newlines_.push_back(static_cast<std::ptrdiff_t>(at));
  const pugi::xml_parse_result result =
      document_.load_buffer(text_.data(), text_.size(), pugi::parse_default, pugi::encoding_utf8);
  if (!result) {
    throw ConfigError(fmt::format("{}:{}: not well-formed XML: {}", name_, line_at(result.offset),
                                  result.description()));
  }
  if (!root()) throw ConfigError(name_ + ": holds no element");
}

int XmlText::line_at(std::ptrdiff_t offset) const {
  return 1 + static_cast<int>(std::ranges::lower_bound(newlines_, offset) - newlines_.begin());
}

int XmlText::line_of(const pugi::xml_node& node) const { return line_at(node.offset_debug()); }

void XmlText::fail(const pugi::xml_node& node, const std::string& words) const {
  throw ConfigError(
      fmt::format("{}:{}: <{}>: {}", name_, line_of(node), shown(node.name()), words));
}

pugi::xml_node XmlText::only(const pugi::xml_node& parent, const char* child) const {
  const pugi::xml_node found = parent.child(child);
  if (!found) fail(parent, fmt::format("<{}> is missing", child));
  if (found.next_sibling(child)) {
    fail(found.next_sibling(child), "occurs twice. Remove one");
  }
  return found;
}

std::string XmlText::attribute(const pugi::xml_node& node, const char* key) const {
  const std::string value(wire::trim(node.attribute(key).value()));
  if (value.empty()) fail(node, fmt::format("{} is missing", key));
  return value;
}

std::string XmlText::text_of(const pugi::xml_node& parent, const char* child) const {
  const pugi::xml_node node = only(parent, child);
  const std::string value(wire::trim(node.child_value()));
  if (value.empty()) fail(node, "is empty");
  return value;
}

int XmlText::integer(const pugi::xml_node& node, const char* what, const std::string& text, int low,
                     int high) const {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < low || value > high) {
    fail(node,
         fmt::format("{} = \"{}\" is not an integer from {} to {}", what, shown(text), low, high));
  }
  return value;
}

}  // namespace cellcal::drivers::krl
