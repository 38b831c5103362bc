#include "daemon/krl/krl_data.h"

#include <algorithm>

#include "calib/model/error.h"
#include "daemon/krl/krl_types.h"

namespace cellcal::daemon::krl {

namespace {

using Kind = Token::Kind;

const std::set<std::string> kCartesianTypes = {"E6POS", "POS", "FRAME"};
const std::set<std::string> kAxisTypes = {"E6AXIS", "AXIS"};

void keep_point(Point point, Data& data) {
  const auto [at, fresh] = data.points.emplace(point.name, point);
  if (!fresh) data.refusals.push_back({Why::kDeclaredTwice, point.file, point.line, point.name});
}

/// NAME[=value]{,NAME[=value]} of a point type, which is tokens[type].
void read_points(const Line& line, std::size_t type, PointKind kind, const std::string& file,
                 bool global, Data& data) {
  const auto& t = line.tokens;
  std::size_t at = type + 1;
  while (at < t.size() && t[at].kind == Kind::kWord) {
    const std::string name = t[at].word;
    if (global) data.globals.insert(name);
    ++at;
    if (sign_at(t, at, '[')) {  // arrays are known by name only
      while (at < t.size() && !is_sign_of(t[at], ']')) ++at;
      if (at < t.size()) ++at;
      data.declared.emplace(name, line.number);
      data.arrays.emplace(name, kind);
    } else if (at + 1 < t.size() && sign_at(t, at, '=')) {
      auto value = read_aggregate(t, at + 1);
      if (!value) {
        data.declared.emplace(name, line.number);
        return;
      }
      at = value->after;
      const auto frame = frame_of(*value);
      if (t[type].is("FRAME") && frame && !data.named_frames.emplace(name, *frame).second)
        data.named_frames.erase(name);
      keep_point({name, kind, file, line.number, std::move(*value)}, data);
    } else {
      data.declared.emplace(name, line.number);
      data.scalars.insert(name);
    }
    if (!sign_at(t, at, ',')) return;
    ++at;
  }
}

void read_frame_data(const Line& line, std::size_t at, const std::string& file, Data& data) {
  const auto& t = line.tokens;
  if (at + 2 >= t.size() || t[at].kind != Kind::kWord || !is_sign_of(t[at + 1], '=')) return;
  const auto value = read_aggregate(t, at + 2);
  if (!value) return;
  const auto [known, fresh] = data.frames.emplace(t[at].word, frame_data_of(*value));
  if (!fresh && known->second != frame_data_of(*value))
    data.refusals.push_back({Why::kDeclaredTwice, file, line.number, t[at].word});
}

void read_named_load(const Line& line, std::size_t at, Data& data) {
  const auto& t = line.tokens;
  if (!sign_at(t, at + 1, '=')) return;
  const auto value = read_aggregate(t, at + 2);
  const auto load = value ? load_stated(*value) : std::nullopt;
  if (load && !data.named_loads.emplace(t[at].word, *load).second)
    data.named_loads.erase(t[at].word);
}

/// NAME[=value]{,NAME[=value]} of the type at tokens[type].
void read_numbers(const Line& line, std::size_t type, bool global, bool constant, Data& data) {
  const auto& t = line.tokens;
  const bool whole = t[type].is("INT");
  for (std::size_t at = type + 1; word_at(t, at); at = next_comma(t, at, t.size()) + 1) {
    if (global && whole) data.globals.insert(t[at].word);
    std::optional<NamedNumber> number;
    const bool given = sign_at(t, at + 1, '=') && next_comma(t, at, t.size()) == at + 3;
    if (const auto value = whole && given ? slot_number(t[at + 2]) : std::nullopt)
      number = NamedNumber{*value, constant};
    if (const auto [known, fresh] = data.named_numbers.emplace(t[at].word, number); !fresh)
      known->second.reset();
  }
}

/// A frame, load or number that a further statement sets is none by name.
void forget_value(const std::string& name, Data& data) {
  data.named_frames.erase(name);
  data.named_loads.erase(name);
  if (const auto at = data.named_numbers.find(name); at != data.named_numbers.end())
    at->second.reset();
  data.frames.erase(name);
}

/// XP.X=5, XP[1].X=5, not XP[1,2]={...}
bool sets_component(const Line& line) {
  const auto mark = std::ranges::find_if(
      line.tokens, [](const Token& one) { return is_sign_of(one, '.') || is_sign_of(one, '='); });
  return mark != line.tokens.end() && is_sign_of(*mark, '.');
}

/// XP={...} of a point declared before, XP[1]={...} of an array of them; XS={...}, XS[1]={...} of any other type.
void read_element(const Line& line, bool global, const std::string& file, Data& data) {
  const auto given = read_given(line, true);
  const std::string& first = line.tokens[0].word;
  if (!given || given->name == first) forget_value(first, data);
  auto value = given ? read_aggregate(line.tokens, given->value) : std::nullopt;
  if (!value) {
    if ((given || sets_component(line)) &&
        data.declared.count(first) + data.points.count(first) > 0)
      data.refusals.push_back({Why::kDeclaredTwice, file, line.number, first});
    return;
  }
  const std::string name = given->element();
  if (global) data.globals.insert(given->name);
  if (const auto array = data.arrays.find(given->name); array != data.arrays.end()) {
    if (name != given->name) keep_point({name, array->second, file, line.number, *value}, data);
    return;
  }
  if (data.scalars.count(name) + data.points.count(name) > 0)
    return keep_point({name, kind_of(*value), file, line.number, *value}, data);
  const auto [at, fresh] =
      data.structures.emplace(name, Point{name, PointKind::kCartesian, file, line.number, *value});
  if (!fresh) at->second.value.numbers.clear();  // stated twice: neither is valid
}

}  // namespace

std::string variable_of(const std::string& name) {
  return name.substr(0, name.find_first_of("[."));
}

std::optional<Point> find_point(const Data& data, const std::string& name) {
  if (const auto own = data.points.find(name); own != data.points.end()) return own->second;
  const auto dot = name.find('.');
  if (dot == std::string::npos) return std::nullopt;
  const auto all = data.structures.find(name.substr(0, dot));
  if (all == data.structures.end()) return std::nullopt;
  Point point = all->second;
  point.name = name;
  point.value = {};
  const std::string prefix = name.substr(dot + 1) + ".";
  for (const auto& [member, number] : all->second.value.numbers)
    if (member.starts_with(prefix))
      point.value.numbers.emplace(member.substr(prefix.size()), number);
  for (const auto& [member, word] : all->second.value.words)
    if (member.starts_with(prefix)) point.value.words.emplace(member.substr(prefix.size()), word);
  if (point.value.numbers.empty()) return std::nullopt;
  point.kind = kind_of(point.value);
  return point;
}

PointKind kind_of(const Aggregate& value) {
  for (const char* axis : {"A1", "A2", "A3", "A4", "A5", "A6"})
    if (value.numbers.count(axis) > 0 || value.words.count(axis) > 0) return PointKind::kAxes;
  return PointKind::kCartesian;
}

FrameData frame_data_of(const Aggregate& value) {
  FrameData data;
  const auto number = [&](const char* name) {
    const auto at = value.numbers.find(name);
    return at == value.numbers.end() ? -1 : slot_number(at->second.value).value_or(-1);
  };
  data.tool = number("TOOL_NO");
  data.base = number("BASE_NO");
  const auto frame = value.words.find("IPO_FRAME");
  data.external = frame != value.words.end() && frame->second != "#BASE";
  return data;
}

bool is_point_type(const std::string& word) {
  return kCartesianTypes.count(word) > 0 || kAxisTypes.count(word) > 0;
}

bool read_declaration(const Line& line, const std::string& file, Data& data) {
  const auto& t = line.tokens;
  const Stated frames = read_controller_frames(line, data);
  const bool other = frames == Stated::kOther;
  if (other || (frames == Stated::kUnreadable && read_given(line)->name == "$ROBROOT"))
    throw calib::FileError(
        file, ":" + std::to_string(line.number) + ": " + read_given(line)->element() + " is not " +
                  (other ? kStatedBefore : "like {X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}"));
  if (frames != Stated::kNothing ||
      calib::read_external_axes(line, data.external) != Stated::kNothing)
    return true;
  std::size_t at = 0;
  bool global = false, constant = false;
  for (; at < t.size() && (t[at].is("DECL") || t[at].is("GLOBAL") || t[at].is("CONST")); ++at) {
    global = global || t[at].is("GLOBAL");
    constant = constant || t[at].is("CONST");
  }
  if (at + 1 >= t.size() || t[at].kind != Kind::kWord) return at > 0;
  if (kCartesianTypes.count(t[at].word) > 0) {
    read_points(line, at, PointKind::kCartesian, file, global, data);
    return true;
  }
  if (kAxisTypes.count(t[at].word) > 0) {
    read_points(line, at, PointKind::kAxes, file, global, data);
    return true;
  }
  if (t[at].is("FDAT")) {
    if (global) data.globals.insert(t[at + 1].word);
    read_frame_data(line, at + 1, file, data);
    return true;
  }
  if (t[at].is("LOAD")) read_named_load(line, at + 1, data);
  read_numbers(line, at, global, constant, data);
  read_element(line, global, file, data);
  return at > 0;
}

void read_data(const KrlFile& file, Data& data) {
  for (const Line& line : read_lines(file)) read_declaration(line, file.name, data);
}

std::vector<Import> imports_of(const KrlFile& file) {
  std::vector<Import> all;
  for (const Line& line : read_lines(file)) {
    const auto& t = line.tokens;
    const std::size_t at = t[0].is("DECL") ? 1 : 0;
    if (at + 2 >= t.size() || !t[at].is("IMPORT") || t[at + 1].is("FDAT")) continue;
    std::size_t dots = at + 3;
    while (dots < t.size() && !(sign_at(t, dots, '.') && sign_at(t, dots + 1, '.'))) ++dots;
    if (word_at(t, dots - 1) && word_at(t, dots + 2))
      all.push_back({t[at + 2].word, t[dots - 1].word, t[dots + 2].word, file.name, line.number});
  }
  return all;
}

std::string module_name(const std::string& file) {
  const std::string name = upper_case(lower_name(file));
  return name.substr(0, name.find('.'));
}

}  // namespace cellcal::daemon::krl
