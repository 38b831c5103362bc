#include "calib/export/krl_values.h"

#include <algorithm>
#include <cmath>

#include "calib/files/text.h"

namespace cellcal::calib::krl {

namespace {

using Kind = Token::Kind;

/// Upper bound of the numbers in these files; KRL's REAL has seven digits.
constexpr double kLargest = 1e7;

/// [n with its ']' at tokens[close]; the index of the next token, or 0.
std::size_t index_until(const std::vector<Token>& t, std::size_t at, std::size_t close,
                        int& index) {
  if (!sign_at(t, at, '[') || !sign_at(t, close, ']')) return 0;
  const auto number = slot_number(t[at + 1]);
  if (!number) return 0;
  index = *number;
  return close + 1;
}

LoadData load_of(const Aggregate& value) {
  LoadData load;
  const auto take = [&](const char* name, double& number) {
    const auto at = value.numbers.find(name);
    if (at != value.numbers.end() && std::abs(at->second.value) <= kLargest)
      number = at->second.value;
  };
  take("M", load.mass_kg);
  constexpr const char* kCentre[] = {"CM.X", "CM.Y", "CM.Z"};
  for (std::size_t i = 0; i < 3; ++i) take(kCentre[i], load.com_mm[i]);
  return load;
}

bool same(const LoadData& a, const LoadData& b) { return a == b; }
bool same(const FrameMmDeg& a, const FrameMmDeg& b) {
  return a.xyz_mm == b.xyz_mm && a.abc_deg == b.abc_deg;
}

template <class V>
Stated put(std::map<int, V>& all, int index, const std::optional<V>& value) {
  if (value)
    return same(all.emplace(index, *value).first->second, *value) ? Stated::kValue : Stated::kOther;
  all.erase(index);
  return Stated::kUnreadable;
}

/// "\"torch\"" without its quotes and blanks, from Latin-1.
Stated put_name(std::map<int, std::string>& names, int index, const Token& token) {
  std::string name;
  for (const char c : token.word)
    if (c != '"') append_utf8(static_cast<unsigned char>(c), name);
  name = shown(trimmed(name));
  if (token.kind != Kind::kText || name.empty())
    names.erase(index);
  else
    names[index] = name;
  return Stated::kValue;
}

}  // namespace

bool is_sign_of(const Token& token, char what) {
  return token.kind == Kind::kSign && token.word[0] == what;
}

bool sign_at(const std::vector<Token>& t, std::size_t at, char what) {
  return at < t.size() && is_sign_of(t[at], what);
}

bool word_at(const std::vector<Token>& t, std::size_t at) {
  return at < t.size() && t[at].kind == Kind::kWord;
}

std::optional<int> slot_number(double value) {
  constexpr double kMost = 1000.0;
  if (!(value >= 0.0 && value <= kMost) || value != std::floor(value)) return std::nullopt;
  return static_cast<int>(value);
}

std::optional<int> slot_number(const Token& token) {
  return token.kind == Kind::kNumber ? slot_number(token.value) : std::nullopt;
}

std::size_t read_index(const std::vector<Token>& t, std::size_t at, int& index) {
  return index_until(t, at, at + 2, index);
}

std::size_t read_indices(const std::vector<Token>& t, std::size_t at, std::string& indices) {
  constexpr int kMost = 3;
  indices.clear();
  for (int i = 0; i < kMost && sign_at(t, at, i == 0 ? '[' : ','); ++i) {
    const auto number = at + 1 < t.size() ? slot_number(t[at + 1]) : std::nullopt;
    if (!number) return 0;
    indices += (i == 0 ? "[" : ",") + std::to_string(*number);
    at += 2;
  }
  if (indices.empty() || !sign_at(t, at, ']')) return 0;
  indices += "]";
  return at + 1;
}

std::optional<Aggregate> read_aggregate(const std::vector<Token>& t, std::size_t at) {
  if (!sign_at(t, at, '{')) return std::nullopt;
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
    if (sign_at(t, at, '[') && sign_at(t, at + 1, ']')) at += 2;  // POINT2[]
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

std::optional<FrameMmDeg> frame_of(const Aggregate& value) {
  constexpr const char* kNames[] = {"X", "Y", "Z", "A", "B", "C"};
  FrameMmDeg frame;
  for (std::size_t i = 0; i < 6; ++i) {
    const auto at = value.numbers.find(kNames[i]);
    if (at == value.numbers.end() || !(std::abs(at->second.value) <= kLargest)) return std::nullopt;
    (i < 3 ? frame.xyz_mm[i] : frame.abc_deg[i - 3]) = at->second.value;
  }
  return frame;
}

std::optional<LoadData> load_stated(const Aggregate& value) {
  for (const char* name : {"M", "CM.X", "CM.Y", "CM.Z"}) {
    const auto at = value.numbers.find(name);
    if (at == value.numbers.end() || !(std::abs(at->second.value) <= kLargest)) return std::nullopt;
  }
  const LoadData load = load_of(value);
  return load.mass_kg >= 0.0 ? std::optional(load) : std::nullopt;
}

std::optional<double> read_number(const std::vector<Token>& t, std::size_t at) {
  const bool minus = sign_at(t, at, '-');
  if (minus || sign_at(t, at, '+')) ++at;
  if (at + 1 != t.size() || t[at].kind != Kind::kNumber || !std::isfinite(t[at].value))
    return std::nullopt;
  return minus ? -t[at].value : t[at].value;
}

std::string Given::element() const {
  return index < 0 ? name + indices : name + "[" + std::to_string(index) + "]";
}

std::optional<Given> read_given(const Line& line, bool several) {
  const auto& t = line.tokens;
  std::size_t words = 0;  // the last word is the variable
  while (words < t.size() && t[words].kind == Kind::kWord) ++words;
  if (words == 0) return std::nullopt;
  Given given;
  given.name = t[words - 1].word;
  std::size_t at = words;
  if (sign_at(t, at, '[') && sign_at(t, at + 1, ']'))
    at += 2;
  else if (sign_at(t, at, '[')) {
    at = index_until(t, at, sign_at(t, at + 2, ',') ? at + 3 : at + 2, given.index);
    if (at == 0 && several) at = read_indices(t, words, given.indices);
  }
  if (at == 0 || at + 1 >= t.size() || !is_sign_of(t[at], '=')) return std::nullopt;
  given.value = at + 1;
  return given;
}

Stated read_controller_frames(const Line& line, ControllerFrames& frames) {
  const auto given = read_given(line);
  if (!given || (given->index < 0) != (given->name == "$ROBROOT")) return Stated::kNothing;
  const auto& [name, index, indices, at] = *given;
  const Token& first = line.tokens[at];
  if (name == "TOOL_NAME") return put_name(frames.tool_names, index, first);
  if (name == "BASE_NAME") return put_name(frames.base_names, index, first);
  if (name == "TOOL_TYPE") {
    frames.fixed_tools.erase(index);
    if (first.is("#TCP")) frames.fixed_tools.insert(index);
    return Stated::kValue;
  }
  const auto value = read_aggregate(line.tokens, at);
  if (name == "LOAD_DATA")
    return put(frames.loads, index, value ? std::optional(load_of(*value)) : std::nullopt);
  const auto frame = value ? frame_of(*value) : std::nullopt;
  if (name == "TOOL_DATA") return put(frames.tools, index, frame);
  if (name == "BASE_DATA") return put(frames.bases, index, frame);
  if (name != "$ROBROOT") return Stated::kNothing;
  if (frame && frames.robroot && !same(*frames.robroot, *frame)) return Stated::kOther;
  frames.robroot = frame;
  return frame ? Stated::kValue : Stated::kUnreadable;
}

}  // namespace cellcal::calib::krl
