#include "drivers/kuka/wire/eki_frame_codec.h"

#include <cmath>
#include <pugixml.hpp>
#include <span>

#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers {
namespace {

using wire::kFrameNames;
using wire::same_name;

constexpr std::size_t kPlace = 3;  // X, Y, Z; the others are angles
constexpr double kLargestInt = 2147483647.0;

/// One element of the state, with values as attributes or elements, names in any case.
class Element {
 public:
  Element(const pugi::xml_node& root, std::string_view name) {
    for (const pugi::xml_node& child : root.children()) {
      if (!same_name(child.name(), name)) continue;
      if (node_) error_ = EkiError::kDuplicate;
      node_ = child;
    }
  }
  explicit operator bool() const { return static_cast<bool>(node_); }
  EkiError error() const { return error_; }

  double number(std::string_view name) {
    const char* text = nullptr;
    const auto take = [&](const char* found, const char* value) {
      if (!same_name(found, name)) return;
      if (text != nullptr) note(EkiError::kDuplicate);
      text = value;
    };
    for (const pugi::xml_attribute& one : node_.attributes()) take(one.name(), one.value());
    for (const pugi::xml_node& one : node_.children()) take(one.name(), one.child_value());
    double value = 0.0;
    if (text == nullptr) {
      note(EkiError::kMissing);
    } else if (!wire::parse_number(text, value)) {
      note(EkiError::kBadNumber);
    }
    return value;
  }
  int whole(std::string_view name, double low, double high) {
    const double value = number(name);
    if (value >= low && value <= high && value == std::floor(value)) return static_cast<int>(value);
    note(EkiError::kBadNumber);
    return static_cast<int>(low);
  }
  EkiFrameValues frame() {
    EkiFrameValues values{};
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = number(kFrameNames.substr(i, 1));
    return values;
  }

 private:
  void note(EkiError error) {
    if (error_ == EkiError::kNone) error_ = error;
  }
  pugi::xml_node node_;
  EkiError error_ = EkiError::kNone;
};

bool load(std::string_view document, pugi::xml_document& parsed) {
  return document.size() <= kMaxEkiDocument &&
         parsed.load_buffer(document.data(), document.size(), pugi::parse_default,
                            pugi::encoding_utf8) &&
         same_name(parsed.document_element().name(), "RobotState");
}

}  // namespace

std::optional<std::string> format_frame_command(const EkiFrameCommand& command) {
  for (const double value : command.values)
    if (!std::isfinite(value)) return std::nullopt;
  std::array<char, kEkiTelegram> buffer{};
  wire::Writer out{std::span<char>(buffer)};
  const auto number = [](auto value) { return static_cast<std::uint64_t>(value); };
  out.put("<RobotCommand><Frame Ask=\"").put(number(command.ask));
  out.put("\" Do=\"").put(number(command.set ? 2 : 1));
  out.put("\" Kind=\"").put(number(command.kind));
  out.put("\" Number=\"").put(number(command.number)).put("\"");
  for (std::size_t i = 0; i < command.values.size(); ++i) {
    out.put(" ").put(kFrameNames.substr(i, 1)).put("=\"");
    out.put(command.values[i], i < kPlace ? kFrameMmDecimals : kFrameDegDecimals).put("\"");
  }
  // Opening and closing tag: some releases of EKI reportedly do not read empty-element tags.
  out.put("></Frame></RobotCommand>");
  if (out.text().empty()) return std::nullopt;
  return std::string(out.text());
}

bool knows_frames(std::string_view document) {
  pugi::xml_document parsed;
  return load(document, parsed) && Element(parsed.document_element(), "Frame");
}

EkiError parse_frame_answer(std::string_view document, std::optional<EkiFrameAnswer>& answer) {
  answer.reset();
  pugi::xml_document parsed;
  if (!load(document, parsed)) return EkiError::kNotXml;
  const pugi::xml_node root = parsed.document_element();
  Element frame(root, "Frame");
  if (!frame) return EkiError::kNone;
  EkiFrameAnswer read;
  read.ask = static_cast<std::uint32_t>(frame.whole("Ask", 0, kLargestInt));
  if (frame.error() != EkiError::kNone) return frame.error();
  if (read.ask == 0) return EkiError::kNone;
  read.done = static_cast<EkiFrameDone>(frame.whole("Done", 0, 6));
  if (frame.error() != EkiError::kNone) return frame.error();
  if (read.done == EkiFrameDone::kIncomplete) {
    answer = read;
    return EkiError::kNone;
  }
  read.set = frame.whole("Do", 1, 2) == 2;
  read.kind = static_cast<EkiFrameKind>(frame.whole("Kind", 1, 3));
  read.number = frame.whole("Number", 0, kLargestInt);
  Element old_frame(root, "FrameOld"), new_frame(root, "FrameNew");
  read.old_values = old_frame.frame();
  read.new_values = new_frame.frame();
  for (const EkiError error : {frame.error(), old_frame.error(), new_frame.error()})
    if (error != EkiError::kNone) return error;
  answer = read;
  return EkiError::kNone;
}

}  // namespace cellcal::drivers
