#include "daemon/krl/krl_inline.h"

#include <algorithm>
#include <map>

#include "calib/export/krl_values.h"
#include "daemon/krl/krl_calls.h"
#include "daemon/krl/krl_types.h"

namespace cellcal::daemon::krl {

namespace {

using Kind = Token::Kind;
using Tokens = std::vector<Token>;
using Arguments = std::map<std::string, Tokens>;

/// 3, -1, #BASE.
bool is_constant(const Tokens& t) {
  return read_number(t, 0) || (t.size() == 1 && t[0].word.starts_with('#'));
}

/// Names nothing: what it sets is unknown.
Tokens unknown_like(const Token& token) {
  Token unknown = token;
  unknown.kind = Kind::kWord;
  unknown.word = "?";
  return {unknown};
}

/// NAME(1,TOOL_DATA[2])
std::vector<Tokens> arguments_of(const Line& call) {
  const Tokens& t = call.tokens;
  std::vector<Tokens> all;
  for (std::size_t at = 2; at + 1 < t.size();) {
    const std::size_t end = next_comma(t, at, t.size() - 1);
    all.emplace_back(t.begin() + static_cast<std::ptrdiff_t>(at),
                     t.begin() + static_cast<std::ptrdiff_t>(end));
    at = end + 1;
  }
  return all;
}

/// A=..., A[1]=..., A.X=..., or another routine's argument.
bool may_change(const Line& line, const std::vector<std::string>& parameters) {
  const Tokens& t = line.tokens;
  const auto is_one = [&](const Token& token) {
    return token.kind == Kind::kWord && std::ranges::count(parameters, token.word) > 0;
  };
  if (is_one(t[0]) || t[0].is("GLOBAL") || t[0].is("TRIGGER") || t[0].is("INTERRUPT")) return true;
  if (t[0].is("FOR") && t.size() > 1 && is_one(t[1])) return true;
  return calls_a_routine(line) && std::ranges::any_of(t, is_one);
}

Line with_arguments(const Line& line, const Arguments& arguments) {
  Line result{line.number, {}};
  for (const Token& token : line.tokens) {
    const auto argument = arguments.find(token.kind == Kind::kWord ? token.word : "");
    if (argument == arguments.end())
      result.tokens.push_back(token);
    else
      std::ranges::copy(argument->second, std::back_inserter(result.tokens));
  }
  return result;
}

/// IF 0==3 THEN; empty: not of two constants.
std::optional<bool> decided(Tokens t) {
  std::erase_if(t, [](const Token& token) { return token.is("(") || token.is(")"); });
  if (t.size() != 6 || !t[0].is("IF") || !t[5].is("THEN") || t[1].kind != Kind::kNumber ||
      t[4].kind != Kind::kNumber)
    return std::nullopt;
  if (sign_at(t, 2, '=') && sign_at(t, 3, '=')) return t[1].value == t[4].value;
  if (sign_at(t, 2, '<') && sign_at(t, 3, '>')) return t[1].value != t[4].value;
  return std::nullopt;
}

/// Without the branches that are not taken.
std::vector<Line> taken(const std::vector<Line>& lines) {
  std::vector<std::optional<bool>> blocks;  ///< of IF; empty: at run time
  std::vector<Line> result;
  for (const Line& line : lines) {
    const Token& first = line.tokens[0];
    const bool ends = first.is("ENDIF") && !blocks.empty(),
               other = first.is("ELSE") && !blocks.empty();
    const bool known = (ends || other) && blocks.back();
    if (ends) blocks.pop_back();
    if (other && known) blocks.back() = !*blocks.back();
    const auto now = first.is("IF") ? decided(line.tokens) : std::nullopt;
    if (!known && !now &&
        std::ranges::all_of(blocks, [](const auto& one) { return one.value_or(true); }))
      result.push_back(line);
    if (first.is("IF")) blocks.push_back(now);
  }
  return result;
}

}  // namespace

std::vector<std::string> parameters_of(const Line& definition) {
  std::vector<std::string> names;
  const Tokens& t = definition.tokens;
  for (std::size_t i = 1; i < t.size(); ++i)
    if (t[i].kind == Kind::kWord && (sign_at(t, i - 1, '(') || sign_at(t, i - 1, ',')))
      names.push_back(t[i].word);
  return names;
}

std::optional<std::vector<Line>> inlined(const std::vector<std::string>& parameters,
                                         const std::vector<Line>& body, const Line& call) {
  const std::vector<Tokens> given = arguments_of(call);
  if (given.size() != parameters.size()) return std::nullopt;
  Arguments arguments;
  for (std::size_t i = 0; i < given.size(); ++i) {
    if (given[i].empty()) return std::nullopt;
    arguments[parameters[i]] = is_constant(given[i]) ? given[i] : unknown_like(given[i][0]);
  }
  std::vector<Line> lines;
  for (const Line& line : body) {
    if (may_change(line, parameters)) return std::nullopt;
    lines.push_back(with_arguments(line, arguments));
  }
  return taken(lines);
}

}  // namespace cellcal::daemon::krl
