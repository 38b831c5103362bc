#include "drivers/kuka/krl/krl_findings.h"

#include <algorithm>
#include <cctype>
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

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    lines.emplace_back(wire::trim(std::string_view(text).substr(at, end - at)));
    at = end + 1;
  }
  while (!lines.empty() && lines.back().empty()) lines.pop_back();
  return lines;
}

}  // namespace

std::vector<FileFinding> Findings::take() {
  std::stable_partition(list_.begin(), list_.end(),
                        [](const FileFinding& one) { return one.refused; });
  return std::exchange(list_, {});
}

std::vector<Candidate> of_kind(const ControllerFiles& files, ControllerFileKind kind) {
  std::vector<Candidate> found;
  for (const auto& [name, text] : files) {
    try {
      if (kind_of(text, name) == kind) found.push_back({name, &text});
    } catch (const ConfigError&) {
      // Reported by report_unreadable().
    }
  }
  return found;
}

void report_unreadable(const ControllerFiles& files, Findings& findings) {
  for (const auto& [name, text] : files) {
    try {
      kind_of(text, name);
    } catch (const ConfigError& error) {
      findings.unreadable(error);
    }
  }
}

const Candidate* choose(const std::vector<Candidate>& candidates, const std::string& name) {
  for (const Candidate& one : candidates) {
    if (wire::same_name(one.name, name)) return &one;
  }
  return candidates.size() == 1 ? &candidates.front() : nullptr;
}

void compare_program(const ControllerFiles& files, const std::string& name,
                     const std::string& expected, Findings& findings) {
  const auto found = std::find_if(files.begin(), files.end(), [&](const auto& one) {
    return wire::same_name(one.first, name);
  });
  if (found == files.end()) {
    findings.warn(name, 0, "is not in the folder: not checked");
    return;
  }
  const std::vector<std::string> have = lines_of(found->second), want = lines_of(expected);
  for (std::size_t i = 0; i < std::max(have.size(), want.size()); ++i) {
    const std::string left = i < have.size() ? have[i] : "", right = i < want.size() ? want[i] : "";
    if (left == right) continue;
    // Comments contain the release number; a pendant rewrites the lines of the head.
    const bool aside = left.starts_with(';') && right.starts_with(';');
    if (aside || (left.starts_with('&') && right.starts_with('&'))) continue;
    findings.warn(found->first, static_cast<int>(i) + 1,
                  "differs from the configuration: \"{}\" instead of \"{}\". Check whether it "
                  "was edited on purpose or is of an older set",
                  shown(left), shown(right));
    return;
  }
}

std::vector<Placed<std::string>> statements(const std::string& text) {
  std::vector<Placed<std::string>> result;
  int number = 0;
  for (std::string line : lines_of(text)) {
    ++number;
    if (line.empty() || line.front() == ';' || line.front() == '&') continue;
    std::transform(line.begin(), line.end(), line.begin(),
                   [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    result.push_back({std::move(line), number});
  }
  return result;
}

}  // namespace krl
}  // namespace cellcal::drivers
