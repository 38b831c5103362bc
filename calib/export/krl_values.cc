#include "calib/export/krl_values.h"

#include <cmath>

namespace cellcal::calib::krl {

namespace {

using Kind = Token::Kind;

/// No number of these files is larger; KRL's REAL holds seven digits.
constexpr double kLargest = 1e7;

}  // namespace

bool is_sign_of(const Token& token, char what) {
  return token.kind == Kind::kSign && token.word[0] == what;
}

std::size_t read_index(const std::vector<Token>& t, std::size_t at, int& index) {
  if (at + 2 >= t.size() || !is_sign_of(t[at], '[') || t[at + 1].kind != Kind::kNumber ||
      !is_sign_of(t[at + 2], ']'))
    return 0;
  const double value = t[at + 1].value;
  if (!(value >= 0.0 && value <= 1000.0) || value != std::floor(value)) return 0;
  index = static_cast<int>(value);
  return at + 3;
}

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

std::optional<double> read_number(const std::vector<Token>& t, std::size_t at) {
  const bool minus = at < t.size() && is_sign_of(t[at], '-');
  if (minus || (at < t.size() && is_sign_of(t[at], '+'))) ++at;
  if (at + 1 != t.size() || t[at].kind != Kind::kNumber || !std::isfinite(t[at].value))
    return std::nullopt;
  return minus ? -t[at].value : t[at].value;
}

std::optional<Given> read_given(const Line& line) {
  const auto& t = line.tokens;
  std::size_t words = 0;  // the last word is the variable
  while (words < t.size() && t[words].kind == Kind::kWord) ++words;
  if (words == 0) return std::nullopt;
  Given given;
  given.name = t[words - 1].word;
  std::size_t at = words;
  if (at + 1 < t.size() && is_sign_of(t[at], '[') && is_sign_of(t[at + 1], ']'))
    at += 2;
  else if (at < t.size() && is_sign_of(t[at], '['))
    at = read_index(t, at, given.index);
  if (at == 0 || at + 1 >= t.size() || !is_sign_of(t[at], '=')) return std::nullopt;
  given.value = at + 1;
  return given;
}

LoadData load_of(const Aggregate& value) {
  LoadData load;
  if (const auto mass = value.numbers.find("M"); mass != value.numbers.end())
    load.mass_kg = mass->second.value;
  constexpr const char* kCentre[] = {"CM.X", "CM.Y", "CM.Z"};
  for (std::size_t i = 0; i < 3; ++i)
    if (const auto one = value.numbers.find(kCentre[i]); one != value.numbers.end())
      load.com_mm[i] = one->second.value;
  return load;
}

}  // namespace cellcal::calib::krl
