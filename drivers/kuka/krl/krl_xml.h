#pragma once
// A controller's XML file from any source, possibly truncated, with errors that name file, line and
// element. Only for the readers of such files, so that pugixml is confined to them.

#include <cstddef>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace cellcal::drivers::krl {

class XmlText {
 public:
  /// Throws ConfigError: larger than kMostFile, not UTF-8, not well-formed, no element.
  XmlText(std::string_view text, std::string name);

  pugi::xml_node root() const { return document_.document_element(); }
  int line_of(const pugi::xml_node& node) const;
  const std::string& name() const { return name_; }

  /// Throws ConfigError "FILE:LINE: <ELEMENT>: words".
  [[noreturn]] void fail(const pugi::xml_node& node, const std::string& words) const;
  /// The child of that name. Throws if there is none, or more than one.
  pugi::xml_node only(const pugi::xml_node& parent, const char* child) const;
  /// Throws if it is missing or empty.
  std::string attribute(const pugi::xml_node& node, const char* key) const;
  /// Trimmed text of the only child of that name.
  std::string text_of(const pugi::xml_node& parent, const char* child) const;
  /// An integer within the limits.
  int integer(const pugi::xml_node& node, const char* what, const std::string& text, int low,
              int high) const;

 private:
  int line_at(std::ptrdiff_t offset) const;

  std::string name_, text_;
  std::vector<std::ptrdiff_t> newlines_;  ///< offsets
  pugi::xml_document document_;
};

}  // namespace cellcal::drivers::krl
