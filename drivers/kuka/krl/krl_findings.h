#pragma once
// For krl_verify_*.cc: collecting what is wrong, and what both wires' sets have in common.

#include <fmt/format.h>

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
  /// What read_...() threw: it names file and line itself.
  void unreadable(const std::exception& error) { list_.push_back({"", 0, error.what(), true}); }
  /// Refused ones first, otherwise as they came.
  std::vector<FileFinding> take();

 private:
  std::vector<FileFinding> list_;
};

/// A file of its kind, by name and text.
struct Candidate {
  std::string name;
  const std::string* text;
};
/// All of that kind; what cannot be read is objected to.
std::vector<Candidate> of_kind(const ControllerFiles& files, ControllerFileKind kind);
void report_unreadable(const ControllerFiles& files, Findings& findings);
/// The candidate that is called so, in any case, else the only one; nullptr: none, or not clear.
const Candidate* choose(const std::vector<Candidate>& candidates, const std::string& name);

/// Warns where a program is missing or is not what the configuration makes: it may have been edited
/// on purpose, or be an older one.
void compare_program(const ControllerFiles& files, const std::string& name,
                     const std::string& expected, Findings& findings);

/// Lines of a program without comments, trimmed, in capitals, with their numbers.
std::vector<Placed<std::string>> statements(const std::string& text);

}  // namespace cellcal::drivers::krl
