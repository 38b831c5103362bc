#include "drivers/kuka/krl/krl_findings.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "drivers/error.h"
#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers {

std::string to_string(const FileFinding& objection) {
  if (objection.file.empty()) return objection.words;
  if (objection.line == 0) return objection.file + ": " + objection.words;
  return fmt::format("{}:{}: {}", objection.file, objection.line, objection.words);
}

namespace krl {
namespace {

bool in_word(char c) {
  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' ||
         c == '$' || c == '.';
}

/// Without comment, and without blanks except between words; in upper case outside of strings.
std::string statement(std::string_view line) {
  std::string result;
  bool quoted = false, blank = false;
  for (const char c : line) {
    if (c == '"') quoted = !quoted;
    if (!quoted && c == ';') break;
    if (!quoted && (c == ' ' || c == '\t' || c == '\r')) {
      blank = true;
      continue;
    }
    if (blank && !result.empty() && in_word(result.back()) && in_word(c)) result += ' ';
    blank = false;
    result += !quoted && c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  }
  return result;
}

}  // namespace

std::vector<FileFinding> Findings::take() {
  std::stable_partition(list_.begin(), list_.end(),
                        [](const FileFinding& one) { return one.refused; });
  return std::exchange(list_, {});
}

bool Findings::refuses(const std::string& file, int line) const {
  return std::ranges::any_of(list_, [&](const FileFinding& one) {
    return one.refused && one.file == file && one.line == line;
  });
}

Candidates by_kind(const ControllerFiles& files, Findings& findings) {
  Candidates all;
  for (const auto& [name, text] : files) try {
      all[kind_of(text, name)].push_back({name, &text});
    } catch (const ConfigError& error) {
      findings.unreadable(error);
    }
  return all;
}

const Candidate* choose(const Candidates& candidates, ControllerFileKind kind,
                        const std::string& name) {
  const auto of_kind = candidates.find(kind);
  if (of_kind == candidates.end()) return nullptr;
  for (const Candidate& one : of_kind->second)
    if (wire::same_name(one.name, name)) return &one;
  return of_kind->second.size() == 1 ? &of_kind->second.front() : nullptr;
}

std::vector<Placed<std::string>> statements(const std::string& text) {
  std::vector<Placed<std::string>> result;
  int number = 0;
  for (std::size_t at = 0, end = 0; at < text.size(); at = end + 1) {
    end = std::min(text.find('\n', at), text.size());
    ++number;
    std::string line = statement(std::string_view(text).substr(at, end - at));
    if (!line.empty() && line.front() != '&') result.push_back({std::move(line), number});
  }
  return result;
}

}  // namespace krl
}  // namespace cellcal::drivers
