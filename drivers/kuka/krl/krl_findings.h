#pragma once
// Collection of findings for krl_verify_*.cc, and checks common to both sets of files.

#include <fmt/format.h>

#include <map>
#include <string>
#include <vector>

#include "drivers/kuka/krl/krl_read.h"
#include "drivers/kuka/krl/krl_verify.h"

namespace cellcal::drivers::krl {

class Findings {
 public:
  template <typename... Args>
  void refuse(const std::string& file, int line, fmt::format_string<Args...> form, Args&&... args) {
    list_.push_back({file, line, fmt::format(form, std::forward<Args>(args)...), true});
  }
  template <typename... Args>
  void warn(const std::string& file, int line, fmt::format_string<Args...> form, Args&&... args) {
    list_.push_back({file, line, fmt::format(form, std::forward<Args>(args)...), false});
  }
  /// From an exception of read_...(), which contains file and line.
  void unreadable(const std::exception& error) { list_.push_back({"", 0, error.what(), true}); }
  /// True if that line has been refused.
  bool refuses(const std::string& file, int line) const;
  /// Refused ones first, otherwise in order.
  std::vector<FileFinding> take();

 private:
  std::vector<FileFinding> list_;
};

/// A file of a certain kind, by name and text.
struct Candidate {
  std::string name;
  const std::string* text;
};
using Candidates = std::map<ControllerFileKind, std::vector<Candidate>>;
/// Unreadable files are reported.
Candidates by_kind(const ControllerFiles& files, Findings& findings);
/// The one of this kind and name, case-insensitive, otherwise the only one of the kind; nullptr: none or ambiguous.
const Candidate* choose(const Candidates& candidates, ControllerFileKind kind,
                        const std::string& name);

/// Removes from a statement of that sub-program what other checks compare.
using LeaveOut = void (*)(const std::string& scope, std::string& statement);

/// Refuses a program that differs from the generated one in what the arm's stop, limits or frames
/// depend on, and warns of other differences and of a missing one: it may have been edited
/// intentionally, or be older.
void compare_program(const ControllerFiles& files, const std::string& name,
                     const std::string& expected, Findings& findings, LeaveOut leave_out = nullptr);

/// Statements of a program with their lines: without head, comments and blanks between other than
/// words, in upper case outside of strings.
std::vector<Placed<std::string>> statements(const std::string& text);

}  // namespace cellcal::drivers::krl
