#pragma once
// A reply of the adapter as a controller with the usual names reads it: corrections and IPOC.

#include <charconv>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cellcal::drivers {

struct SenFrame {
  std::string ipoc;
  std::vector<double> axes_deg;  ///< <AK>
  std::vector<double> space;     ///< <RKorr>
};

/// Text between `begin` and the next `end`; empty without them.
inline std::string_view between(std::string_view text, std::string_view begin,
                                std::string_view end) {
  const std::size_t at = text.find(begin);
  if (at == std::string_view::npos) return {};
  const std::string_view rest = text.substr(at + begin.size());
  return rest.substr(0, rest.find(end));
}

/// Values of an element's attributes; empty if one is not a number.
inline std::vector<double> attribute_values(std::string_view element) {
  std::vector<double> values;
  for (std::size_t at = element.find('"'); at != std::string_view::npos;) {
    const std::size_t close = element.find('"', at + 1);
    if (close == std::string_view::npos) return {};
    const auto [end, error] =
        std::from_chars(element.data() + at + 1, element.data() + close, values.emplace_back());
    if (error != std::errc() || end != element.data() + close) return {};
    at = element.find('"', close + 1);
  }
  return values;
}

/// Empty if the text is not a reply.
inline std::optional<SenFrame> read_sen(std::string_view text) {
  if (!text.starts_with("<Sen Type=\"") || !text.ends_with("</Sen>")) return std::nullopt;
  return SenFrame{std::string(between(text, "<IPOC>", "</IPOC>")),
                  attribute_values(between(text, "<AK ", "/>")),
                  attribute_values(between(text, "<RKorr ", "/>"))};
}

}  // namespace cellcal::drivers
