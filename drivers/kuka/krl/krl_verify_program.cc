// Comparison of a program with the generated one, statement by statement.

#include <algorithm>
#include <string_view>

#include "drivers/kuka/krl/krl_findings.h"
#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers::krl {
namespace {

constexpr std::size_t kMostDifferences = 10;
/// Bounds time and memory of the comparison of two texts that have nothing in common.
constexpr std::size_t kMostPairs = 4'000'000;

/// Sub-programs whose every statement counts, and words of others that the arm's stop, limits or frames
/// depend on.
constexpr std::string_view kGuards[] = {
    "CC_FENCE", "CC_FINISH", "CC_GUARDS_OFF", "CC_HALT", "CC_HIGH", "CC_INSIDE", "CC_LINK",
    "CC_LOW",   "CC_MOVE",   "CC_ON_",        "CC_PART", "CC_READ", "CC_START",  "CC_WATCH"};
constexpr std::string_view kGuardWords[] = {
    "INTERRUPT", "$IN[",         "$FLAG[",   "$TIMER",         "BRAKE",  "RESUME",    "STOP",
    "$ADVANCE",  "$SOFT",        "LIMIT",    "$VEL",           "$ACC",   "$TOOL=",    "$BASE=",
    "CC_BUSY",   "CC_ENDING",    "CC_GUARD", "CC_LATCH",       "CC_OUT", "CC_REASON", "RSI_CREATE",
    "RSI_LOAD",  "RSI_MOVECORR", "RSI_OFF",  "RSI_PROCESS_OFF"};
/// Statements that decide whether, and when, others are executed.
constexpr std::string_view kFlow[] = {
    "IF",       "ELSE",    "ENDIF",  "FOR",  "ENDFOR",  "WHILE",     "ENDWHILE", "REPEAT", "UNTIL",
    "LOOP",     "ENDLOOP", "SWITCH", "CASE", "DEFAULT", "ENDSWITCH", "GOTO",     "EXIT",   "RETURN",
    "CONTINUE", "HALT",    "WAIT",   "DEF",  "DEFFCT",  "END",       "ENDFCT"};

struct Line {
  std::string text;
  int number;
  bool guards;
};

/// One place at which the texts differ; nullptr: no statement there.
struct Difference {
  const Line *have, *want;
  int number;

  bool guards() const { return (have && have->guards) || (want && want->guards); }
};

bool guards(const std::string& scope, const std::string& line) {
  std::string code;
  bool quoted = false;
  for (const char c : line) {
    if (c == '"') quoted = !quoted;
    if (!quoted) code += c;
  }
  const auto has = [&](std::string_view word) { return code.find(word) != std::string::npos; };
  return std::ranges::any_of(kGuards,
                             [&](auto one) { return scope.starts_with(one) || has(one); }) ||
         std::ranges::any_of(kGuardWords, has) ||
         std::ranges::find(kFlow, code.substr(0, code.find_first_of(" (=:"))) != std::end(kFlow);
}

std::vector<Line> compared(const std::string& name, const std::string& text, LeaveOut leave_out) {
  const bool data = wire::lower(name).ends_with(".dat");
  std::vector<Line> result;
  std::string scope;
  for (auto& [line, number] : statements(text)) {
    if (line.starts_with("DEF ") || line.starts_with("DEFFCT ")) {
      const std::string head = line.substr(0, line.find('('));
      scope = head.substr(head.rfind(' ') + 1);
    }
    // The controller writes the newest values of variables into a data list; nothing sets this one.
    if (data && line.find("CC_MAY_RUN") == std::string::npos)
      line.erase(std::min(line.find('='), line.size()));
    if (leave_out != nullptr) leave_out(scope, line);
    result.push_back({line, number, guards(scope, line)});
  }
  return result;
}

/// Of the longest common sequence; `from` and the ends of the texts exclude what is the same anyway.
std::vector<Difference> differences(const std::vector<Line>& have, const std::vector<Line>& want,
                                    std::size_t from, std::size_t have_end, std::size_t want_end) {
  const auto same = [&](std::size_t i, std::size_t j) { return have[i].text == want[j].text; };
  const std::size_t width = want_end - from + 1;
  std::vector<int> table((have_end - from + 1) * width, 0);
  const auto common = [&](std::size_t i, std::size_t j) -> int& {
    return table[(i - from) * width + j - from];
  };
  for (std::size_t i = have_end; i-- > from;)
    for (std::size_t j = want_end; j-- > from;)
      common(i, j) =
          same(i, j) ? common(i + 1, j + 1) + 1 : std::max(common(i + 1, j), common(i, j + 1));
  std::vector<Difference> found;
  for (std::size_t i = from, j = from; i < have_end || j < want_end; ++i, ++j) {
    const std::size_t first_have = i, first_want = j;
    while ((i < have_end || j < want_end) && !(i < have_end && j < want_end && same(i, j)))
      ++(j == want_end || (i < have_end && common(i + 1, j) >= common(i, j + 1)) ? i : j);
    for (std::size_t k = 0; k < std::max(i - first_have, j - first_want); ++k) {
      const Line* left = first_have + k < i ? &have[first_have + k] : nullptr;
      const Line* right = first_want + k < j ? &want[first_want + k] : nullptr;
      const int next = i < have.size() ? have[i].number : have.empty() ? 0 : have.back().number;
      found.push_back({left, right, left != nullptr ? left->number : next});
    }
  }
  return found;
}

/// With what differs from the other statement, and some of what precedes it.
std::string quoted(const Line* line, const Line* other) {
  constexpr std::ptrdiff_t kWhole = 40, kBefore = 20;
  if (line == nullptr) return "no statement";
  if (other == nullptr) return fmt::format("\"{}\"", shown(line->text));
  const auto at = std::ranges::mismatch(line->text, other->text).in1 - line->text.begin();
  if (at <= kWhole) return fmt::format("\"{}\"", shown(line->text));
  return fmt::format(
      "\"...{}\"",
      shown(std::string_view(line->text).substr(static_cast<std::size_t>(at - kBefore))));
}

}  // namespace

void compare_program(const ControllerFiles& files, const std::string& name,
                     const std::string& expected, Findings& findings, LeaveOut leave_out) {
  const auto found = std::find_if(files.begin(), files.end(), [&](const auto& one) {
    return wire::same_name(one.first, name);
  });
  if (found == files.end()) {
    findings.warn(name, 0, "is not in the folder: not checked");
    return;
  }
  const std::string& file = found->first;
  const std::vector<Line> have = compared(name, found->second, leave_out),
                          want = compared(name, expected, leave_out);
  std::size_t from = 0, have_end = have.size(), want_end = want.size();
  while (from < std::min(have_end, want_end) && have[from].text == want[from].text) ++from;
  while (std::min(have_end, want_end) > from && have[have_end - 1].text == want[want_end - 1].text)
    --have_end, --want_end;
  if ((have_end - from + 1) * (want_end - from + 1) > kMostPairs) {
    findings.refuse(file, 0,
                    "has {} statements, as generated {}: not compared. Make the files again",
                    have.size(), want.size());
    return;
  }
  std::vector<Difference> list = differences(have, want, from, have_end, want_end);
  std::erase_if(list, [&](const Difference& one) {
    return one.have != nullptr && findings.refuses(file, one.number);
  });
  std::ranges::stable_partition(list, &Difference::guards);
  for (std::size_t i = 0; i < std::min(list.size(), kMostDifferences); ++i) {
    const auto& [left, right, line] = list[i];
    const std::string words = fmt::format("differs from the configuration: {} instead of {}",
                                          quoted(left, right), quoted(right, left));
    if (list[i].guards())
      findings.refuse(
          file, line,
          "{}: the arm's stop, its limits or its frames depend on it. Make the files again", words);
    else
      findings.warn(file, line, "{}. Check whether it was edited on purpose or is of an older set",
                    words);
  }
  if (list.size() > kMostDifferences)
    findings.warn(file, 0, "{} more statements differ", list.size() - kMostDifferences);
}

}  // namespace cellcal::drivers::krl
