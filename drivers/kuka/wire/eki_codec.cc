#include "drivers/kuka/wire/eki_codec.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <pugixml.hpp>

#include "drivers/kuka/wire/xml_arena.h"
#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers {
namespace {

using wire::kAxesPerElement;
using wire::same_name;

constexpr std::size_t kEkiArenaBytes = kMaxEkiDocument * 48;  // as in RSI's parser
constexpr int kDecimals = 6;  // 1e-6 deg, below REAL's own resolution
constexpr int kDurationDecimals = 4;

/// Looks up values in one document and keeps the first error.
class Reader {
 public:
  explicit Reader(const pugi::xml_node& root) : root_(root) {}
  EkiError error() const { return error_; }

  /// An element of the root by name; null if absent.
  pugi::xml_node element(std::string_view name) {
    pugi::xml_node found;
    for (const pugi::xml_node& child : root_.children()) {
      if (!same_name(child.name(), name)) continue;
      if (found) note(EkiError::kDuplicate);
      found = child;
    }
    return found;
  }

  /// The text of an attribute or, failing that, of a child element; null if both are absent.
  const char* text(const pugi::xml_node& node, std::string_view name) {
    const char* found = nullptr;
    for (const pugi::xml_attribute& attribute : node.attributes()) {
      if (!same_name(attribute.name(), name)) continue;
      if (found != nullptr) note(EkiError::kDuplicate);
      found = attribute.value();
    }
    for (const pugi::xml_node& child : node.children()) {
      if (!same_name(child.name(), name)) continue;
      if (found != nullptr) note(EkiError::kDuplicate);
      found = child.child_value();
    }
    return found;
  }

  std::optional<double> number(const pugi::xml_node& node, std::string_view name) {
    const char* found = text(node, name);
    if (found == nullptr) return std::nullopt;
    double value = 0.0;
    if (!wire::parse_number(found, value)) note(EkiError::kBadNumber);
    return value;
  }

  std::optional<std::uint32_t> count(const pugi::xml_node& node, std::string_view name) {
    const std::optional<double> value = number(node, name);
    if (!value) return std::nullopt;
    constexpr double kMost = 4294967295.0;
    if (!(*value >= 0.0 && *value <= kMost) || *value != std::floor(*value)) {
      note(EkiError::kBadNumber);
      return 0;
    }
    return static_cast<std::uint32_t>(*value);
  }

  std::uint32_t needed(const pugi::xml_node& node, std::string_view name) {
    const auto value = count(node, name);
    if (!value) note(EkiError::kMissing);
    return value.value_or(0);
  }

  /// An enumerator 0..last.
  int choice(std::uint32_t value, int last) {
    if (value > static_cast<std::uint32_t>(last)) note(EkiError::kBadNumber);
    return static_cast<int>(value);
  }

  /// A1.. of one element, E1.. of another, up to the first gap.
  AxisAngles axes(std::string_view first, std::string_view external, int& decimals) {
    AxisAngles values;
    append(element(first), 'A', values, decimals);
    if (values.size() == kAxesPerElement) append(element(external), 'E', values, decimals);
    return values;
  }

 private:
  void append(const pugi::xml_node& node, char letter, AxisAngles& values, int& decimals) {
    for (std::size_t i = 0; node && i < kAxesPerElement; ++i) {
      const char name[] = {letter, static_cast<char>('1' + i)};
      const char* found = text(node, {name, sizeof name});
      if (found == nullptr) return;
      double value = 0.0;
      if (!wire::parse_measure(found, value)) note(EkiError::kBadNumber);
      values.push_back(value);
      decimals = std::max(decimals, wire::count_decimals(found));
    }
  }
  void note(EkiError error) {
    if (error_ == EkiError::kNone) error_ = error;
  }

  pugi::xml_node root_;
  EkiError error_ = EkiError::kNone;
};

EkiError read_state(const pugi::xml_node& root, EkiState& state) {
  Reader in(root);
  state.session = in.needed(root, "Session");
  state.heard = in.needed(root, "Heard");
  state.time_ms = in.count(root, "Time");
  state.axes_deg = in.axes("Axis", "Ext", state.decimals);
  const pugi::xml_node move = in.element("Move");
  state.move_id = in.needed(move, "Id");
  state.progress = static_cast<EkiProgress>(in.choice(in.needed(move, "State"), 2));
  state.outcome = static_cast<EkiOutcome>(in.choice(in.needed(move, "Outcome"), 8));
  if (const pugi::xml_node latch = in.element("Latch")) {
    int unused = 0;
    state.latch_id = in.count(latch, "Id");
    state.latch_deg = in.axes("Latch", "LatchExt", unused);
  }
  const pugi::xml_node status = in.element("Status");
  state.ready = in.needed(status, "Ready") != 0;
  state.mode = static_cast<EkiMode>(in.choice(in.count(status, "Mode").value_or(0), 4));
  state.drives = in.count(status, "Drives").value_or(1) != 0;
  state.stopped = in.count(status, "Stopped").value_or(0) != 0;
  state.input = in.count(status, "Input").value_or(0) != 0;
  state.override_percent = in.choice(in.count(status, "Override").value_or(100), 100);
  state.fault = in.choice(in.count(status, "Fault").value_or(0), 1'000'000);
  state.bad = in.count(status, "Bad").value_or(0);
  state.pass_ms = in.count(status, "Pass").value_or(0);
  state.request = static_cast<EkiRequest>(in.choice(in.count(status, "Request").value_or(0), 3));
  if (in.error() != EkiError::kNone) return in.error();
  return state.axes_deg.empty() ? EkiError::kNoAxes : EkiError::kNone;
}

}  // namespace

const char* to_string(EkiError error) {
  switch (error) {
    case EkiError::kNone:
      return "none";
    case EkiError::kOversized:
      return "document of more than 8192 bytes";
    case EkiError::kNotXml:
      return "not well-formed XML";
    case EkiError::kWrongRoot:
      return "root element is not RobotState";
    case EkiError::kMissing:
      return "an element of the channel's SEND part is missing (Session, Heard, Move/@Id, @State, "
             "@Outcome, Status/@Ready)";
    case EkiError::kNoAxes:
      return "no Axis/@A1";
    case EkiError::kBadNumber:
      return "a value is not a finite number, or not an integer where one is needed";
    case EkiError::kDuplicate:
      return "an element or attribute occurs twice";
  }
  return "unknown";
}

struct EkiParser::Memory {
  XmlArena arena{kEkiArenaBytes};
  std::array<char, kMaxEkiDocument> text{};
};

EkiParser::EkiParser() : memory_(std::make_unique<Memory>()) {}
EkiParser::~EkiParser() = default;
EkiParser::EkiParser(EkiParser&&) noexcept = default;
EkiParser& EkiParser::operator=(EkiParser&&) noexcept = default;

EkiError EkiParser::parse_state(std::string_view document, EkiState& state) {
  state = EkiState{};
  if (document.size() > memory_->text.size()) return EkiError::kOversized;
  if (document.empty()) return EkiError::kNotXml;
  const XmlArena::Scope scope(memory_->arena);
  pugi::xml_document parsed;
  std::memcpy(memory_->text.data(), document.data(), document.size());
  // The encoding is fixed: detection could make pugixml convert, and allocate.
  if (!parsed.load_buffer_inplace(memory_->text.data(), document.size(), pugi::parse_default,
                                  pugi::encoding_utf8)) {
    return EkiError::kNotXml;
  }
  const pugi::xml_node root = parsed.document_element();
  if (!same_name(root.name(), "RobotState")) return EkiError::kWrongRoot;
  return read_state(root, state);
}

std::string_view format_command(const EkiCommand& command, std::span<char> buffer) {
  const std::span<const double> target(command.target_deg.data(), command.target_deg.size());
  const auto number = [](auto value) { return static_cast<std::uint64_t>(value); };
  const auto axes = [&](wire::Writer& out, std::string_view name, char letter,
                        std::span<const double> values) {
    out.put("<").put(name);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const char attribute[] = {' ', letter, static_cast<char>('1' + i), '=', '"'};
      out.put({attribute, sizeof attribute}).put(values[i], kDecimals).put("\"");
    }
    // Opening and closing tag: some releases of EKI reportedly do not read empty-element tags.
    out.put("></").put(name).put(">");
  };
  wire::Writer out(buffer);
  out.put("<RobotCommand Session=\"").put(number(command.session));
  out.put("\" Seq=\"").put(number(command.seq)).put("\" Type=\"").put(number(command.type));
  out.put("\" Id=\"").put(number(command.id)).put("\">");
  axes(out, "Axis", 'A', target.first(std::min(target.size(), kAxesPerElement)));
  if (target.size() > kAxesPerElement) axes(out, "Ext", 'E', target.subspan(kAxesPerElement));
  out.put("<Move Guard=\"").put(number(command.guard)).put("\" Path=\"").put(number(command.path));
  out.put("\" Percent=\"").put(number(command.percent)).put("\" Duration=\"");
  out.put(command.duration_s, kDurationDecimals).put("\"></Move></RobotCommand>");
  return out.text();
}

}  // namespace cellcal::drivers
