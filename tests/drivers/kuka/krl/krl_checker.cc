#include "tests/drivers/kuka/krl/krl_checker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>

#include "tests/drivers/kuka/krl/krl_assignment.h"
#include "tests/drivers/kuka/krl/krl_lines.h"

namespace cellcal::drivers::krl {
namespace {

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
  std::string previous;
  int folds = 0;
  std::size_t number = 0;
  for (const std::string& line : lines_of(text)) {
    ++number;
    if (line.empty() || line.back() != '\r') complain(number, "does not end with CR LF");
    for (const char c : line) {
      if (static_cast<unsigned char>(c) >= 0x7F) complain(number, "a character beyond ASCII");
    }
    const std::string whole = upper(trimmed(line));
    folds += whole.starts_with(";FOLD") ? 1 : whole.starts_with(";ENDFOLD") ? -1 : 0;
    if (folds < 0) complain(number, ";ENDFOLD without ;FOLD");
    const std::string code = trimmed(without_comment(line));
    if (code.empty() || code.front() == '&') continue;
    const std::vector<std::string> found = words(code);
    if (found.empty()) continue;
    if (found.front() == "HALT" && previous != "LOOP") {
      complain(number, "HALT outside of LOOP: the next start goes on behind it");
    }
    previous = found.front();
  }
  if (folds > 0) complain(number, ";FOLD has no end");
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
