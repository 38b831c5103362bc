#include "daemon/krl/own_position.h"

#include <algorithm>
#include <utility>

#include "calib/model/error.h"
#include "daemon/krl/krl_calls.h"

namespace cellcal::daemon::krl {

namespace {

using Tokens = std::vector<Token>;
const std::string kItself;

/// Index after NAME, NAME[..] or NAME.X at tokens[at]. `same`: no correction changes its last component.
std::size_t behind(const Tokens& t, std::size_t at, bool& same) {
  static const std::set<std::string> unchanged = {"E1", "E2", "E3", "E4", "E5", "E6", "S", "T"};
  for (++at; sign_at(t, at, '[') || (sign_at(t, at, '.') && word_at(t, at + 1));) {
    const bool component = sign_at(t, at, '.');
    same = component && unchanged.count(t[at + 1].word) > 0;
    const std::size_t end = component ? at + 2 : closed(t, at);
    if (end == 0) return t.size();
    at = end;
  }
  return at;
}

std::string key_of_function(const std::string& name) { return name + "()"; }

}  // namespace

bool states_own_position(const std::string& word) {
  for (const char* of : {"$POS_", "$AXIS_"})
    for (const char* which : {"ACT", "INT", "FOR", "BACK", "RET"})
      if (word.starts_with(std::string(of) + which)) return true;
  return false;
}

OwnPosition::OwnPosition(const BackupFiles& files, const Types& types) : types_(types) {
  std::vector<std::vector<Line>> sources;  // by the number of a module in Types
  for (const ProgramFiles& one : files.modules) sources.push_back(read_lines(one.src));
  for (const ProgramFiles& one : files.modules)
    for (const KrlFile& other : one.modules) try {
        sources.emplace_back();
        sources.back() = read_lines(other);
      } catch (const calib::FileError&) {  // not a text: as if it were not given
      }
  for (std::size_t i = 0; i < sources.size(); ++i)
    for (const Line& line : sources[i])
      if (begins_routine(line)) keep_parameters(line, i);
  for (std::size_t i = 0; i < sources.size(); ++i) {
    std::string routine;
    for (const Line& line : sources[i]) {
      if (begins_routine(line)) routine = routine_name(line);
      if (!declares(line) || line.tokens[0].is("INTERRUPT")) read(line, i, routine);
    }
  }
  for (std::size_t i = 0; i < files.modules.size(); ++i)
    if (files.modules[i].dat) keep_taught(*files.modules[i].dat, i);
  settle();
}

/// DECL E6POS XP1={X 900.0,...}: taught, and of the arm's own position only where a program puts that into it as well.
/// Zeros alone are no place.
void OwnPosition::keep_taught(const KrlFile& dat, std::size_t module) {
  for (const Line& line : read_lines(dat)) {
    const Tokens& t = line.tokens;
    const auto equals = std::ranges::find_if(t, [](const Token& one) { return one.is("="); });
    const bool stated = std::any_of(equals, t.end(), [](const Token& one) {
      return one.kind == Token::Kind::kNumber && one.value != 0.0;
    });
    if (!stated) continue;
    for (auto name = t.begin(); name != equals; ++name)
      if (name + 1 == equals || (name + 1)->is("["))
        if (name->kind == Token::Kind::kWord) flow(types_.key(module, 0, name->word), {}, false);
  }
}

/// DEF NAME(A :IN,B :OUT)
void OwnPosition::keep_parameters(const Line& line, std::size_t module) {
  const Tokens& t = line.tokens;
  std::size_t at = 0;
  while (at < t.size() && !sign_at(t, at, '(')) ++at;
  std::vector<Parameter> all;
  for (++at; word_at(t, at); at = next_comma(t, at, t.size()) + 1)
    all.push_back({types_.key(module, line.number, t[at].word),
                   sign_at(t, at + 1, ':') && at + 2 < t.size() && t[at + 2].is("IN")});
  parameters_.emplace(routine_name(line), std::move(all));
}

void OwnPosition::flow(const std::string& to, const std::vector<Value>& from, bool whole) {
  Flow& one = flows_.emplace_back(Flow{to, {}, whole});
  for (const Value& value : from) one.from.push_back(value.key);
}

void OwnPosition::read(const Line& line, std::size_t module, const std::string& routine) {
  const Tokens& t = line.tokens;
  give_arguments(line, module);
  bool same = false;
  const std::size_t equals = behind(t, 0, same);
  const bool assigned = word_at(t, 0) && sign_at(t, equals, '=') && !sign_at(t, equals + 1, '=');
  const std::size_t begin = t[0].is("RETURN") ? 1 : equals + 1;
  if (same || !(assigned || t[0].is("RETURN"))) return;
  // INT LAYER=($POS_ACT.Z-Z0)/50: a count, which a correction of the place does not change.
  const bool divided = std::any_of(t.begin() + static_cast<std::ptrdiff_t>(begin), t.end(),
                                   [](const Token& one) { return one.is("/"); });
  if (divided && types_.of_variable(module, line.number, t[0].word, {}) == "INT") return;
  flow(assigned ? types_.key(module, line.number, t[0].word) : key_of_function(routine),
       values(module, line, begin, t.size()), begin + 1 == t.size() && (!assigned || equals == 1));
}

/// NAME(..): to its parameters, and back from those that are not :IN.
void OwnPosition::give_arguments(const Line& line, std::size_t module) {
  const Tokens& t = line.tokens;
  for (std::size_t i = 0; i < t.size(); ++i) {
    const auto [first, last] = parameters_.equal_range(t[i].word);
    const std::size_t closing = first != last && sign_at(t, i + 1, '(') ? closed(t, i + 1) : 0;
    for (auto one = first; closing > 0 && one != last; ++one) {
      std::size_t at = i + 2;
      for (const Parameter& parameter : one->second) {
        const std::size_t next = next_comma(t, at, closing - 1);
        if (next >= closing) break;
        const std::vector<Value> given = values(module, line, at, next);
        flow(parameter.key, given, next == at + 1);
        if (!parameter.in && next == at + 1 && !given.empty())
          flow(given[0].key, {{parameter.key, {}}}, true);
        at = next + 1;
      }
    }
  }
}

std::vector<OwnPosition::Value> OwnPosition::values(std::size_t module, const Line& line,
                                                    std::size_t begin, std::size_t end) const {
  const Tokens& t = line.tokens;
  std::vector<Value> all;
  std::string open(1, ' ');
  for (std::size_t at = begin; at < end; ++at) {
    const std::string& word = t[at].word;
    if (t[at].kind == Token::Kind::kSign) {
      if (word == "{" || word == "(" || word == "[") open += word;
      if ((word == "}" || word == ")" || word == "]") && open.size() > 1) open.pop_back();
    }
    // An index selects an element and is no part of its value.
    if (!word_at(t, at) || open.find('[') != std::string::npos) continue;
    const char before =
        at > begin && t[at - 1].kind == Token::Kind::kSign ? t[at - 1].word[0] : ' ';
    const bool component = open.back() == '{' && (before == '{' || before == ',' || before == ':');
    if (component || before == '.') continue;
    const bool called = sign_at(t, at + 1, '(');
    bool same = false;
    if (!called) behind(t, at, same);
    if (same) continue;
    all.push_back({states_own_position(word) ? kItself
                   : called                  ? key_of_function(word)
                                             : types_.key(module, line.number, word),
                   word});
    if (!called || word != "INVERSE") continue;
    // The axes near which it seeks a posture are no part of its result.
    const std::size_t closing = std::max(closed(t, at + 1), at + 3) - 1;
    for (Value& one : values(module, line, at + 2, next_comma(t, at + 2, closing)))
      all.push_back(std::move(one));
    at = closing;
  }
  return all;
}

void OwnPosition::settle() {
  std::multimap<std::string, const Flow*> out;
  for (const Flow& one : flows_)
    for (const std::string& key : one.from) out.emplace(key, &one);
  const auto spread = [&](std::set<std::string>& all, const auto& passes) {
    std::vector<std::string> open(all.begin(), all.end());
    while (!open.empty()) {
      const auto [first, last] = out.equal_range(std::exchange(open.back(), {}));
      open.pop_back();
      for (auto one = first; one != last; ++one)
        if (passes(*one->second) && all.insert(one->second->to).second)
          open.push_back(one->second->to);
    }
  };
  reached_ = {kItself};
  spread(reached_, [](const Flow&) { return true; });
  for (const Flow& one : flows_)
    if (reached(one.to) && (!one.whole || one.from.empty() || !reached(one.from[0])))
      mixed_.insert(one.to);
  spread(mixed_, [&](const Flow& one) { return reached(one.to); });
}

std::string OwnPosition::source(std::size_t module, const Line& line, std::size_t begin,
                                std::size_t end) const {
  for (const Value& one : values(module, line, begin, end))
    if (reached(one.key)) return one.word;
  return {};
}

bool OwnPosition::reaches(std::size_t module, int line, const std::string& name) const {
  return states_own_position(name) || reached(types_.key(module, line, name));
}

bool OwnPosition::whole(std::size_t module, int line, const std::string& name) const {
  const std::string key = types_.key(module, line, name);
  return !key.empty() && reached(key) && mixed_.count(key) == 0;
}

}  // namespace cellcal::daemon::krl
