#include "tests/drivers/kuka/krl/krl_checker.h"

#include <algorithm>
#include <cctype>
#include <map>

#include "tests/drivers/kuka/krl/krl_assignment.h"
#include "tests/drivers/kuka/krl/krl_lines.h"

namespace cellcal::drivers::krl {
namespace {

constexpr std::size_t kLongestName = 24;

bool in_name(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

std::vector<std::string> words(const std::string& code) {
  std::vector<std::string> result;
  bool quoted = false;
  for (std::size_t i = 0; i < code.size();) {
    if (code[i] == '"') quoted = !quoted;
    if (quoted || !in_name(code[i]) || std::isdigit(static_cast<unsigned char>(code[i])) != 0) {
      // A number, including one with an exponent, is not a name.
      if (!quoted && std::isdigit(static_cast<unsigned char>(code[i])) != 0) {
        while (i < code.size() && (in_name(code[i]) || code[i] == '.')) ++i;
        continue;
      }
      ++i;
      continue;
    }
    std::size_t end = i;
    while (end < code.size() && in_name(code[end])) ++end;
    const bool system = i > 0 && code[i - 1] == '$';
    result.push_back((system ? "$" : "") + upper(code.substr(i, end - i)));
    i = end;
  }
  return result;
}

const std::map<std::string, std::string> kEnds{
    {"DEF", "END"},      {"DEFFCT", "ENDFCT"},    {"DEFDAT", "ENDDAT"},
    {"IF", "ENDIF"},     {"FOR", "ENDFOR"},       {"WHILE", "ENDWHILE"},
    {"LOOP", "ENDLOOP"}, {"SWITCH", "ENDSWITCH"}, {"REPEAT", "UNTIL"}};

class Nesting {
 public:
  explicit Nesting(std::vector<std::string>& complaints) : complaints_(complaints) {}
  void open(const std::string& word, std::size_t line) { stack_.emplace_back(word, line); }
  void close(const std::string& word, const std::string& opener, std::size_t line) {
    if (!stack_.empty() && stack_.back().first == opener) {
      stack_.pop_back();
      return;
    }
    complaints_.push_back("line " + std::to_string(line) + ": " + word + " without " + opener);
  }
  void end() {
    for (const auto& [word, line] : stack_) {
      complaints_.push_back("line " + std::to_string(line) + ": " + word + " has no end");
    }
  }
  bool inside(const std::string& word) const {
    return std::any_of(stack_.begin(), stack_.end(),
                       [&](const auto& one) { return one.first == word; });
  }

 private:
  std::vector<std::string>& complaints_;
  std::vector<std::pair<std::string, std::size_t>> stack_;
};

}  // namespace

std::vector<std::string> code_lines(std::string_view text) {
  std::vector<std::string> result;
  for (const std::string& line : lines_of(text)) {
    const std::string code = trimmed(without_comment(line));
    if (!code.empty() && code.front() != '&') result.push_back(code);
  }
  return result;
}

std::vector<std::string> identifiers(std::string_view text) {
  std::vector<std::string> result;
  for (const std::string& code : code_lines(text)) {
    for (std::string& word : words(code)) result.push_back(std::move(word));
  }
  return result;
}

std::vector<std::string> check_krl(std::string_view text) {
  std::vector<std::string> complaints;
  const auto complain = [&](std::size_t line, const std::string& what) {
    complaints.push_back("line " + std::to_string(line) + ": " + what);
  };
  Nesting blocks(complaints), folds(complaints);
  bool statements = false;
  std::string previous;
  std::size_t number = 0;
  for (const std::string& line : lines_of(text)) {
    ++number;
    if (line.empty() || line.back() != '\r') complain(number, "does not end with CR LF");
    for (const char c : line) {
      if (static_cast<unsigned char>(c) >= 0x7F) complain(number, "a character beyond ASCII");
    }
    const std::string whole = upper(trimmed(line));
    if (whole.rfind(";FOLD", 0) == 0) folds.open(";FOLD", number);
    if (whole.rfind(";ENDFOLD", 0) == 0) folds.close(";ENDFOLD", ";FOLD", number);
    const std::string code = trimmed(without_comment(line));
    if (code.empty() || code.front() == '&') continue;
    if (std::count(code.begin(), code.end(), '"') % 2 != 0) complain(number, "a quote too few");
    if (std::count(code.begin(), code.end(), '(') != std::count(code.begin(), code.end(), ')')) {
      complain(number, "brackets do not match");
    }
    const std::vector<std::string> found = words(code);
    for (const std::string& name : found) {
      if (name.size() > kLongestName) complain(number, "name " + name + " is longer than 24");
    }
    if (found.empty()) continue;
    const std::string& first = found.front();
    if (first == "HALT" && previous != "LOOP") {
      complain(number, "HALT outside of LOOP: the next start goes on behind it");
    }
    previous = first;
    if (first == "DEF" || first == "DEFFCT" || first == "DEFDAT") statements = false;
    const bool data = first == "DECL" || first == "EXT" || first == "INT" || first == "REAL";
    if (first == "DECL" && statements) complain(number, "declaration behind a statement");
    if (!data && kEnds.count(first) == 0 && first.rfind("END", 0) != 0) statements = true;
    if (first == "IF" && std::find(found.begin(), found.end(), "THEN") == found.end()) {
      complain(number, "IF without THEN");
    }
    if (first == "CASE" && !blocks.inside("SWITCH")) complain(number, "CASE without SWITCH");
    if (first == "ELSE" && !blocks.inside("IF")) complain(number, "ELSE without IF");
    if (kEnds.count(first) != 0) blocks.open(first, number);
    for (const auto& [opener, closer] : kEnds) {
      if (first == closer) blocks.close(closer, opener, number);
    }
  }
  blocks.end();
  folds.end();
  for (std::string& one : check_assignments(text)) complaints.push_back(std::move(one));
  return complaints;
}

std::size_t line_of(const std::vector<std::string>& lines, const std::string& begin,
                    std::size_t from) {
  for (std::size_t i = from; i < lines.size(); ++i) {
    if (lines[i].rfind(begin, 0) == 0) return i;
  }
  ADD_FAILURE() << "no line begins with " << begin;
  return lines.size();
}

std::vector<std::string> body(const std::string& text, const std::string& head) {
  const std::vector<std::string> lines = code_lines(text);
  const std::size_t from = line_of(lines, head);
  const std::size_t to = std::min(line_of(lines, "END", from), lines.size());
  std::size_t end = from;
  while (end < lines.size() && lines[end] != "END" && lines[end] != "ENDFCT") ++end;
  EXPECT_LE(to, end + 1);
  return {lines.begin() + static_cast<std::ptrdiff_t>(std::min(from, lines.size())),
          lines.begin() + static_cast<std::ptrdiff_t>(std::min(end, lines.size()))};
}

}  // namespace cellcal::drivers::krl
