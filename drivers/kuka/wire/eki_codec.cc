#include "drivers/kuka/wire/eki_codec.h"

#include <algorithm>
#include <cmath>
#include <pugixml.hpp>
#include <random>

#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers {
namespace {

using wire::kAxesPerElement;
using wire::kFrameNames;
using wire::same_name;

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

  EkiFrameValues frame(const pugi::xml_node& node, bool (*parse)(std::string_view, double&)) {
    EkiFrameValues values{};
    for (std::size_t i = 0; i < values.size(); ++i) {
      const char* found = text(node, kFrameNames.substr(i, 1));
      if (found == nullptr) note(EkiError::kMissing);
      if (found != nullptr && !parse(found, values[i])) note(EkiError::kBadNumber);
    }
    return values;
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

  /// Required, low..high.
  int whole(const pugi::xml_node& node, std::string_view name, std::uint32_t low, int high) {
    const std::uint32_t value = needed(node, name);
    if (value < low) note(EkiError::kBadNumber);
    return choice(value, high);
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

// As the controller numbers them.
static_assert(static_cast<int>(OperatingMode::kT1) == 1 &&
              static_cast<int>(OperatingMode::kExt) == 4);
static_assert(static_cast<int>(ControllerRequest::kBrakeTest) == 1 &&
              static_cast<int>(ControllerRequest::kCollision) == 3);

EkiError read_state(const pugi::xml_node& root, EkiState& state) {
  Reader in(root);
  state.session = in.needed(root, "Session");
  state.heard = in.needed(root, "Heard");
  state.time_ms = in.count(root, "Time");
  state.axes_deg = in.axes("Axis", "Ext", state.decimals);
  const pugi::xml_node pos = in.element("Pos");
  state.sends_tcp = !pos.empty();
  // Empty where a program that does not set it runs with this channel file.
  if (const char* known = in.text(pos, "Known"); known != nullptr && *known != '\0')
    if (in.count(pos, "Known") != 0u) state.tcp = in.frame(pos, wire::parse_measure);
  const pugi::xml_node move = in.element("Move");
  state.move_id = in.needed(move, "Id");
  state.progress = static_cast<EkiProgress>(in.whole(move, "State", 0, 2));
  state.outcome = static_cast<EkiOutcome>(in.whole(move, "Outcome", 0, 8));
  if (const pugi::xml_node latch = in.element("Latch")) {
    int unused = 0;
    state.latch_id = in.count(latch, "Id");
    state.latch_deg = in.axes("Latch", "LatchExt", unused);
  }
  const pugi::xml_node status = in.element("Status");
  state.ready = in.needed(status, "Ready") != 0;
  state.mode = static_cast<OperatingMode>(in.choice(in.count(status, "Mode").value_or(0), 4));
  state.drives = in.count(status, "Drives").value_or(1) != 0;
  state.stopped = in.count(status, "Stopped").value_or(0) != 0;
  state.input = in.count(status, "Input").value_or(0) != 0;
  state.override_percent = in.choice(in.count(status, "Override").value_or(100), 100);
  state.fault = in.choice(in.count(status, "Fault").value_or(0), 1'000'000);
  state.bad = in.count(status, "Bad").value_or(0);
  state.pass_ms = in.count(status, "Pass").value_or(0);
  state.request =
      static_cast<ControllerRequest>(in.choice(in.count(status, "Request").value_or(0), 3));
  if (in.error() != EkiError::kNone) return in.error();
  return state.axes_deg.empty() ? EkiError::kNoAxes : EkiError::kNone;
}

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

bool starts_name(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }

constexpr std::size_t kPlace = 3;  // X, Y, Z; the others are angles
constexpr int kLargestInt = 2147483647;

bool load(std::string_view document, pugi::xml_document& parsed) {
  return document.size() <= kMaxEkiDocument &&
         parsed.load_buffer(document.data(), document.size(), pugi::parse_default,
                            pugi::encoding_utf8) &&
         same_name(parsed.document_element().name(), "RobotState");
}

}  // namespace

std::uint32_t draw_number() {
  std::random_device device;
  return std::uniform_int_distribution<std::uint32_t>(1, 0x7FFFFFFE)(device);
}

const char* to_string(EkiError error) {
  switch (error) {
    case EkiError::kNone: return "none";
    case EkiError::kOversized: return "document of more than 8192 bytes";
    case EkiError::kNotXml: return "not well-formed XML";
    case EkiError::kWrongRoot: return "root element is not RobotState";
    case EkiError::kMissing:
      return "an element of the channel's SEND part is missing (Session, Heard, Move/@Id, @State, "
             "@Outcome, Status/@Ready)";
    case EkiError::kNoAxes: return "no Axis/@A1";
    case EkiError::kBadNumber:
      return "a value is not a finite number, or not an integer where one is needed";
    case EkiError::kDuplicate: return "an element or attribute occurs twice";
  }
  return "unknown";
}

EkiError EkiParser::parse_state(std::string_view document, EkiState& state) {
  state = EkiState{};
  if (document.size() > kMaxEkiDocument) return EkiError::kOversized;
  if (document.empty()) return EkiError::kNotXml;
  const XmlArena::Scope scope(arena_);
  pugi::xml_document parsed;
  if (!arena_.load(document, parsed)) return EkiError::kNotXml;
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

void EkiFramer::reset() {
  state_ = State::kOutside;
  size_ = name_size_ = matched_ = skipped_ = 0;
  quote_ = last_ = '\0';
}

EkiFramer::Event EkiFramer::keep(char c) {
  if (size_ == bytes_.size()) return Event::kOversized;
  bytes_[size_++] = c;
  return Event::kNone;
}

EkiFramer::Event EkiFramer::push(char c) {
  if (state_ == State::kOutside) {
    size_ = name_size_ = 0;
    if (c == '<') {
      skipped_ = 0;
      state_ = State::kOpened;
      return keep(c);
    }
    return ++skipped_ > kMaxEkiDocument ? Event::kOversized : Event::kNone;
  }
  if (state_ == State::kProlog) {
    if (c == '>') state_ = State::kOutside;
    return ++skipped_ > kMaxEkiDocument ? Event::kOversized : Event::kNone;
  }
  if (state_ == State::kOpened && !starts_name(c)) {
    state_ = c == '?' || c == '!' ? State::kProlog : State::kOutside;
    return Event::kNone;
  }
  if (const Event full = keep(c); full != Event::kNone) return full;
  switch (state_) {
    case State::kOpened:
      state_ = State::kName;
      name_size_ = 1;
      return Event::kNone;
    case State::kName:
      if (!is_space(c) && c != '/' && c != '>') {
        ++name_size_;
        return Event::kNone;
      }
      state_ = State::kRootTag;
      quote_ = last_ = '\0';
      return on_root_tag(c);
    case State::kRootTag: return on_root_tag(c);
    case State::kBody:
      if (c == '<') state_ = State::kBodyTag;
      return Event::kNone;
    case State::kBodyTag:
      matched_ = 0;
      state_ = c == '/' ? State::kClosing : State::kBody;
      return Event::kNone;
    case State::kClosing: return on_closing(c);
    case State::kOutside:
    case State::kProlog: break;
  }
  return Event::kNone;
}

EkiFramer::Event EkiFramer::on_root_tag(char c) {
  if (quote_ != '\0') {
    if (c == quote_) quote_ = '\0';
    return Event::kNone;
  }
  if (c == '"' || c == '\'') {
    quote_ = c;
  } else if (c == '>') {
    const bool empty = last_ == '/';
    state_ = empty ? State::kOutside : State::kBody;
    return empty ? Event::kDocument : Event::kNone;
  }
  last_ = c;
  return Event::kNone;
}

EkiFramer::Event EkiFramer::on_closing(char c) {
  if (matched_ < name_size_) {
    if (c == name()[matched_]) {
      ++matched_;
    } else {
      state_ = c == '<' ? State::kBodyTag : State::kBody;
    }
    return Event::kNone;
  }
  if (is_space(c)) return Event::kNone;
  if (c == '>') {
    state_ = State::kOutside;
    return Event::kDocument;
  }
  state_ = c == '<' ? State::kBodyTag : State::kBody;
  return Event::kNone;
}

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
  return load(document, parsed) && Reader(parsed.document_element()).element("Frame");
}

EkiError parse_frame_answer(std::string_view document, std::optional<EkiFrameAnswer>& answer) {
  answer.reset();
  pugi::xml_document parsed;
  if (!load(document, parsed)) return EkiError::kNotXml;
  Reader in(parsed.document_element());
  const pugi::xml_node frame = in.element("Frame");
  if (!frame) return EkiError::kNone;
  EkiFrameAnswer read;
  read.ask = static_cast<std::uint32_t>(in.whole(frame, "Ask", 0, kLargestInt));
  if (in.error() != EkiError::kNone) return in.error();
  if (read.ask == 0) return EkiError::kNone;
  read.done = static_cast<EkiFrameDone>(in.whole(frame, "Done", 0, 6));
  if (in.error() != EkiError::kNone) return in.error();
  if (read.done == EkiFrameDone::kIncomplete) {
    answer = read;
    return EkiError::kNone;
  }
  read.set = in.whole(frame, "Do", 1, 2) == 2;
  read.kind = static_cast<EkiFrameKind>(in.whole(frame, "Kind", 1, 3));
  read.number = in.whole(frame, "Number", 0, kLargestInt);
  read.old_values = in.frame(in.element("FrameOld"), wire::parse_number);
  read.new_values = in.frame(in.element("FrameNew"), wire::parse_number);
  if (in.error() != EkiError::kNone) return in.error();
  answer = read;
  return EkiError::kNone;
}

}  // namespace cellcal::drivers
