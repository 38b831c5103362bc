#include "drivers/kuka/wire/rsi_codec.h"

#include <algorithm>
#include <charconv>
#include <pugixml.hpp>

#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers {

using wire::count_decimals;
using wire::kAxesPerElement;
using wire::lower;
using wire::parse_measure;
using wire::parse_number;
using wire::same_name;
using wire::trim;
using wire::Writer;

const char* to_string(WireError error) {
  switch (error) {
    case WireError::kNone: return "none";
    case WireError::kEmpty: return "empty datagram";
    case WireError::kOversized: return "datagram of more than 8192 bytes";
    case WireError::kNotXml: return "not well-formed XML, or truncated";
    case WireError::kWrongRoot: return "root element is not the one of RSI";
    case WireError::kNoIpoc: return "no IPOC";
    case WireError::kBadIpoc: return "IPOC is not a decimal number";
    case WireError::kNoAxes: return "no AIPos with A1 (add DEF_AIPos to SEND of the ethernet XML)";
    case WireError::kBadNumber: return "a value is not a finite number, or above 1000000";
    case WireError::kDuplicate: return "an element or attribute occurs twice";
  }
  return "unknown";
}

std::string_view format_sen(const RsiNames& names, std::span<const double> correction, int decimals,
                            std::optional<int> stop, std::string_view ipoc, std::span<char> buffer,
                            std::string_view space_tag) {
  const std::size_t axes = std::min(correction.size(), kAxesPerElement);
  Writer out(buffer);
  out.put("<Sen Type=\"").put(names.sentype).put("\">");
  if (!space_tag.empty()) {
    out.frame(space_tag, correction.first(axes), decimals);
  } else {
    out.element(names.axis_tag, 'A', correction.first(axes), decimals);
    if (correction.size() > axes) {
      out.element(names.external_axis_tag, 'E', correction.subspan(axes), decimals);
    }
  }
  if (stop && !names.stop_tag.empty()) {
    out.put("<").put(names.stop_tag).put(*stop != 0 ? ">1</" : ">0</").put(names.stop_tag);
    out.put(">");
  }
  out.put("<IPOC>").put(ipoc).put("</IPOC></Sen>");
  return out.text();
}

namespace {

WireError parse_ipoc(std::string_view text, Ipoc& ipoc) {
  const std::string_view digits = trim(text);
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (digits.empty() || error != std::errc() || end != digits.data() + digits.size()) {
    return WireError::kBadIpoc;
  }
  if (!ipoc.text.assign(text)) return WireError::kBadIpoc;
  ipoc.value = static_cast<std::uint32_t>(value);
  return WireError::kNone;
}

// Attributes A1..A6 (or E1..E6), up to the first gap.
WireError parse_axes(const pugi::xml_node& element, char letter, AxisAngles& values,
                     int* decimals = nullptr) {
  std::array<const char*, kAxesPerElement> texts{};
  for (const pugi::xml_attribute& attribute : element.attributes()) {
    const char* name = attribute.name();
    if (lower(name[0]) != lower(letter) || name[1] < '1' || name[1] > '6' || name[2] != '\0') {
      continue;
    }
    const char*& slot = texts[static_cast<std::size_t>(name[1] - '1')];
    if (slot != nullptr) return WireError::kDuplicate;
    slot = attribute.value();
  }
  values.clear();
  for (const char* text : texts) {
    if (text == nullptr) break;
    double value = 0.0;
    if (!parse_measure(text, value)) return WireError::kBadNumber;
    values.push_back(value);
    if (decimals != nullptr) *decimals = std::max(*decimals, count_decimals(text));
  }
  return WireError::kNone;
}

// The first attribute, or the text.
WireError parse_delay(const pugi::xml_node& element, std::optional<std::uint32_t>& delay) {
  if (!element) return WireError::kNone;
  const pugi::xml_attribute attribute = element.first_attribute();
  double late = 0.0;
  if (!parse_number(attribute ? attribute.value() : element.child_value(), late) || late < 0.0 ||
      late > 4294967295.0) {
    return WireError::kBadNumber;
  }
  delay = static_cast<std::uint32_t>(late);
  return WireError::kNone;
}

// All six of X Y Z A B C, or none.
WireError parse_frame(const pugi::xml_node& element, std::optional<KukaFrame>& frame) {
  KukaFrame values{};
  for (std::size_t i = 0; i < values.size(); ++i) {
    const char* text = nullptr;
    for (const pugi::xml_attribute& attribute : element.attributes()) {
      if (!same_name(attribute.name(), wire::kFrameNames.substr(i, 1))) continue;
      if (text != nullptr) return WireError::kDuplicate;
      text = attribute.value();
    }
    if (text == nullptr) return WireError::kNone;
    if (!parse_measure(text, values[i])) return WireError::kBadNumber;
  }
  frame = values;
  return WireError::kNone;
}

// The only value of "Element.Attribute", or of "Element"; empty: absent, duplicate, or not a
// number.
std::optional<double> sent_value(const pugi::xml_node& root, std::string_view tag) {
  const std::size_t dot = tag.find('.');
  const char* text = nullptr;
  const auto note = [&](const char* found) {
    const bool only = text == nullptr;
    text = found;
    return only;
  };
  for (const pugi::xml_node& child : root.children()) {
    if (tag.empty() || !same_name(child.name(), tag.substr(0, dot))) continue;
    if (dot == std::string_view::npos && !note(child.child_value())) return std::nullopt;
    for (const pugi::xml_attribute& attribute : child.attributes()) {
      const bool meant =
          dot != std::string_view::npos && same_name(attribute.name(), tag.substr(dot + 1));
      if (meant && !note(attribute.value())) return std::nullopt;
    }
  }
  double value = 0.0;
  if (text == nullptr || !parse_number(text, value)) return std::nullopt;
  return value;
}

// KRL numbers MODE_OP from 1: T1, T2, AUT, EX.
OperatingMode mode_of(std::optional<double> value) {
  for (const OperatingMode mode :
       {OperatingMode::kT1, OperatingMode::kT2, OperatingMode::kAut, OperatingMode::kExt})
    if (value == static_cast<double>(mode)) return mode;
  return OperatingMode::kUnknown;
}

std::optional<int> percent_of(std::optional<double> value) {
  if (!value || !(*value >= 0.0 && *value <= 100.0)) return std::nullopt;
  return static_cast<int>(*value + 0.5);
}

// A digital input of one bit.
std::optional<bool> level_of(std::optional<double> value) {
  if (value == 0.0 || value == 1.0) return value == 1.0;
  return std::nullopt;
}

// An element that may occur once.
struct Seen {
  pugi::xml_node node;
  bool twice = false;
  void note(const pugi::xml_node& found) {
    twice = twice || node;
    node = found;
  }
};

// Extracts the counter of a datagram that is not XML, so that the held correction can still be
// sent.
bool find_ipoc(std::string_view bytes, Ipoc& ipoc) {
  constexpr std::string_view kOpen = "<IPOC>";
  const auto at = bytes.find(kOpen);
  if (at == std::string_view::npos) return false;
  const std::string_view rest = bytes.substr(at + kOpen.size());
  const auto close = rest.find('<');
  // Without the closing tag the number may be truncated.
  return close != std::string_view::npos &&
         parse_ipoc(rest.substr(0, close), ipoc) == WireError::kNone;
}

}  // namespace

WireError RsiParser::parse_rob(std::string_view bytes, RobFrame& frame, const RsiNames& names) {
  frame = RobFrame{};
  if (bytes.empty()) return WireError::kEmpty;
  if (bytes.size() > kMaxRsiDatagram) return WireError::kOversized;
  const XmlArena::Scope scope(arena_);
  pugi::xml_document document;
  if (!arena_.load(bytes, document)) {
    frame.has_ipoc = find_ipoc(bytes, frame.ipoc);
    return WireError::kNotXml;
  }
  const pugi::xml_node root = document.document_element();
  if (!same_name(root.name(), "Rob")) return WireError::kWrongRoot;

  Seen ipoc, actual, actual_external, setpoint, setpoint_external, delay, tcp;
  int elements = 0;
  for (const pugi::xml_node& child : root.children()) {
    const std::string_view name = child.name();
    if (name.empty()) continue;
    ++elements;
    if (same_name(name, "IPOC")) ipoc.note(child);
    if (same_name(name, "AIPos")) actual.note(child);
    if (same_name(name, "EIPos")) actual_external.note(child);
    if (same_name(name, "ASPos")) setpoint.note(child);
    if (same_name(name, "ESPos")) setpoint_external.note(child);
    if (same_name(name, "Delay")) delay.note(child);
    if (same_name(name, "RIst")) tcp.note(child);
  }
  if (!ipoc.node) return WireError::kNoIpoc;
  if (ipoc.twice) return WireError::kDuplicate;
  if (const WireError error = parse_ipoc(ipoc.node.child_value(), frame.ipoc);
      error != WireError::kNone) {
    return error;
  }
  frame.has_ipoc = true;
  frame.foreign_hand = root.attribute("TYPE") || bytes.find(" />") != std::string_view::npos;
  frame.only_ipoc = elements == 1;
  // Delay is read even if the axes are invalid.
  const WireError delay_error =
      delay.twice ? WireError::kDuplicate : parse_delay(delay.node, frame.delay);
  if (!actual.node) return WireError::kNoAxes;
  if (actual.twice || actual_external.twice || setpoint.twice || setpoint_external.twice)
    return WireError::kDuplicate;
  const WireError errors[] = {
      parse_axes(actual.node, 'A', frame.axes_deg, &frame.decimals),
      parse_axes(actual_external.node, 'E', frame.external_deg),
      parse_axes(setpoint.node, 'A', frame.setpoint_axes_deg),
      parse_axes(setpoint_external.node, 'E', frame.setpoint_external_deg),
      delay_error,
  };
  // Mode, override, contact input and RIst are optional: invalid values count as not sent, and the
  // packet as valid.
  frame.mode = mode_of(sent_value(root, names.mode_tag));
  frame.override_percent = percent_of(sent_value(root, names.override_tag));
  frame.input_on = level_of(sent_value(root, names.contact_tag));
  if (tcp.twice || parse_frame(tcp.node, frame.tcp) != WireError::kNone) frame.tcp.reset();
  for (const WireError error : errors) {
    if (error != WireError::kNone) return error;
  }
  return frame.axes_deg.empty() ? WireError::kNoAxes : WireError::kNone;
}

}  // namespace cellcal::drivers
