#include "daemon/krl/krl_data.h"

#include <cmath>

#include "calib/model/error.h"

namespace cellcal::daemon::krl {

namespace {

using Kind = Token::Kind;

/// No number of these files is larger; KRL's REAL holds seven digits.
constexpr double kLargest = 1e7;

const std::set<std::string> kCartesianTypes = {"E6POS", "POS", "FRAME"};
const std::set<std::string> kAxisTypes = {"E6AXIS", "AXIS"};

bool is_sign_of(const Token& token, char what) {
  return token.kind == Kind::kSign && token.word[0] == what;
}

/// [n] with a plain number, from tokens[at]; the index of the token behind it, or 0.
std::size_t read_index(const std::vector<Token>& t, std::size_t at, int& index) {
  if (at + 2 >= t.size() || !is_sign_of(t[at], '[') || t[at + 1].kind != Kind::kNumber ||
      !is_sign_of(t[at + 2], ']'))
    return 0;
  const double value = t[at + 1].value;
  if (!(value >= 0.0 && value <= 1000.0) || value != std::floor(value)) return 0;
  index = static_cast<int>(value);
  return at + 3;
}

void keep_point(Point point, Data& data) {
  const auto [at, fresh] = data.points.emplace(point.name, point);
  if (!fresh) data.refusals.push_back({Why::kTwice, point.file, point.line, point.name});
}

/// TOOL_DATA[1]={...}, BASE_DATA, LOAD_DATA, $ROBROOT={...}.
bool read_controller_data(const std::vector<Token>& t, std::size_t at, Data& data) {
  const std::string& name = t[at].word;
  int index = -1;
  std::size_t equals = at + 1;
  if (name == "TOOL_DATA" || name == "BASE_DATA" || name == "LOAD_DATA")
    equals = read_index(t, at + 1, index);
  else if (name != "$ROBROOT")
    return false;
  if (equals == 0 || equals + 1 >= t.size() || !is_sign_of(t[equals], '=')) return false;
  const auto value = read_aggregate(t, equals + 1);
  const auto frame = value ? frame_of(*value) : std::nullopt;
  // What cannot be read is not the value before it either.
  if (name == "TOOL_DATA") data.tools.erase(index);
  if (name == "BASE_DATA") data.bases.erase(index);
  if (name == "LOAD_DATA") data.loads.erase(index);
  if (!value) return false;
  if (name == "LOAD_DATA") {
    LoadData load;
    if (const auto mass = value->numbers.find("M"); mass != value->numbers.end())
      load.mass_kg = mass->second.value;
    constexpr const char* kCentre[] = {"CM.X", "CM.Y", "CM.Z"};
    for (std::size_t i = 0; i < 3; ++i)
      if (const auto one = value->numbers.find(kCentre[i]); one != value->numbers.end())
        load.com_mm[i] = one->second.value;
    data.loads[index] = load;
    return true;
  }
  if (!frame) return false;
  if (name == "TOOL_DATA")
    data.tools[index] = *frame;
  else if (name == "BASE_DATA")
    data.bases[index] = *frame;
  else
    data.robroot = *frame;
  return true;
}

/// [FRAME] $ROBROOT={...}: where the arm stands is never guessed.
bool read_robroot(const Line& line, std::size_t at, const std::string& file, Data& data) {
  const auto& t = line.tokens;
  if (at < t.size() && is_point_type(t[at].word)) ++at;
  if (at >= t.size() || !t[at].is("$ROBROOT")) return false;
  if (at + 1 == t.size()) return true;  // declared, and stated elsewhere or not at all
  if (!read_controller_data(t, at, data))
    throw calib::FileError(file,
                           ":" + std::to_string(line.number) +
                               ": $ROBROOT is not like {X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}");
  return true;
}

/// NAME[=value]{,NAME[=value]} of a point type, from tokens[at].
void read_points(const Line& line, std::size_t at, PointKind kind, const std::string& file,
                 bool global, Data& data) {
  const auto& t = line.tokens;
  while (at < t.size() && t[at].kind == Kind::kWord) {
    const std::string name = t[at].word;
    if (global) data.globals.insert(name);
    ++at;
    if (at < t.size() && is_sign_of(t[at], '[')) {  // arrays are known by name only
      while (at < t.size() && !is_sign_of(t[at], ']')) ++at;
      if (at < t.size()) ++at;
      data.declared.emplace(name, line.number);
    } else if (at + 1 < t.size() && is_sign_of(t[at], '=')) {
      auto value = read_aggregate(t, at + 1);
      if (!value) {
        data.declared.emplace(name, line.number);
        return;
      }
      at = value->after;
      keep_point({name, kind, file, line.number, std::move(*value)}, data);
    } else {
      data.declared.emplace(name, line.number);
    }
    if (at >= t.size() || !is_sign_of(t[at], ',')) return;
    ++at;
  }
}

void read_frame_data(const Line& line, std::size_t at, Data& data) {
  const auto& t = line.tokens;
  if (at + 2 >= t.size() || t[at].kind != Kind::kWord || !is_sign_of(t[at + 1], '=')) return;
  if (const auto value = read_aggregate(t, at + 2)) data.frames[t[at].word] = frame_data_of(*value);
}

}  // namespace

std::optional<Aggregate> read_aggregate(const std::vector<Token>& t, std::size_t at) {
  if (at >= t.size() || !is_sign_of(t[at], '{')) return std::nullopt;
  Aggregate result;
  std::string prefix;  // of nested aggregates: "CM."
  std::vector<std::string> outer;
  constexpr std::size_t kDeepest = 4;
  for (++at; at < t.size(); ++at) {
    if (is_sign_of(t[at], '}')) {
      if (outer.empty()) {
        result.after = at + 1;
        return result;
      }
      prefix = outer.back();
      outer.pop_back();
      continue;
    }
    if (is_sign_of(t[at], ',')) continue;
    if (t[at].kind != Kind::kWord || at + 1 >= t.size()) return std::nullopt;
    const std::string name = prefix + t[at].word;
    if (is_sign_of(t[at + 1], ':')) {  // the type: {E6POS: X 1.0,...}
      ++at;
      continue;
    }
    ++at;
    if (at + 1 < t.size() && is_sign_of(t[at], '[') && is_sign_of(t[at + 1], ']'))
      at += 2;  // POINT2[]
    if (at >= t.size()) return std::nullopt;
    if (is_sign_of(t[at], '{')) {
      if (outer.size() == kDeepest) return std::nullopt;
      outer.push_back(prefix);
      prefix = name + ".";
      continue;
    }
    const bool minus = is_sign_of(t[at], '-');
    const std::size_t begin = t[at].begin;
    if ((minus || is_sign_of(t[at], '+')) && at + 1 < t.size()) ++at;
    if (t[at].kind == Kind::kNumber) {
      if (!result.numbers
               .emplace(name, Number{minus ? -t[at].value : t[at].value, begin, t[at].end})
               .second)
        return std::nullopt;
      // "1.0.0" or "1.0x" is no number.
      if (at + 1 < t.size() && !is_sign_of(t[at + 1], ',') && !is_sign_of(t[at + 1], '}'))
        return std::nullopt;
    } else if (t[at].kind == Kind::kWord || t[at].kind == Kind::kText) {
      result.words.emplace(name, t[at].word);
    } else {
      return std::nullopt;
    }
  }
  return std::nullopt;
}

std::optional<calib::FrameMmDeg> frame_of(const Aggregate& value) {
  constexpr const char* kNames[] = {"X", "Y", "Z", "A", "B", "C"};
  calib::FrameMmDeg frame;
  for (std::size_t i = 0; i < 6; ++i) {
    const auto at = value.numbers.find(kNames[i]);
    if (at == value.numbers.end() || !(std::abs(at->second.value) <= kLargest)) return std::nullopt;
    (i < 3 ? frame.xyz_mm[i] : frame.abc_deg[i - 3]) = at->second.value;
  }
  return frame;
}

FrameData frame_data_of(const Aggregate& value) {
  FrameData data;
  const auto number = [&](const char* name) {
    const auto at = value.numbers.find(name);
    const bool usable = at != value.numbers.end() && at->second.value >= -1.0 &&
                        at->second.value <= 1000.0 &&
                        at->second.value == std::floor(at->second.value);
    return usable ? static_cast<int>(at->second.value) : -1;
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
  std::size_t at = 0;
  bool global = false;
  for (; at < t.size() && (t[at].is("DECL") || t[at].is("GLOBAL") || t[at].is("CONST")); ++at)
    global = global || t[at].is("GLOBAL");
  if (read_robroot(line, at, file, data)) return true;
  if (at + 1 >= t.size() || t[at].kind != Kind::kWord) return at > 0;
  if (kCartesianTypes.count(t[at].word) > 0) {
    read_points(line, at + 1, PointKind::kCartesian, file, global, data);
    return true;
  }
  if (kAxisTypes.count(t[at].word) > 0) {
    read_points(line, at + 1, PointKind::kAxes, file, global, data);
    return true;
  }
  if (t[at].is("FDAT")) {
    read_frame_data(line, at + 1, data);
    return true;
  }
  if (read_controller_data(t, at, data)) return true;
  return at > 0;
}

void read_data(const KrlFile& file, Data& data) {
  for (const Line& line : read_lines(file)) read_declaration(line, file.name, data);
}

}  // namespace cellcal::daemon::krl
