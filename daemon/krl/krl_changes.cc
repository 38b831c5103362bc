#include "daemon/krl/krl_changes.h"

#include "calib/export/krl_values.h"

namespace cellcal::daemon::krl {

namespace {

void change(const std::vector<Token>& t, std::size_t at, ChangedNumbers& changed) {
  // In a declaration this is the array's length.
  const bool declares = t[0].is("DECL") || t[0].is("GLOBAL") || t[0].is("FRAME") || t[0].is("LOAD");
  int number = 0;
  if (!declares && read_index(t, at + 1, number) > 0)
    changed.numbers.insert(number);
  else
    changed.all = true;
}

void merge_numbers(const ChangedNumbers& from, ChangedNumbers& into) {
  into.all = into.all || from.all;
  into.numbers.insert(from.numbers.begin(), from.numbers.end());
}

}  // namespace

bool sets_kinematic_base(const std::vector<Token>& t) {
  return t.size() > 3 && t[0].is("$BASE") && sign_at(t, 1, '=') && t[2].is("EK");
}

void add_changes(const Line& line, FrameChanges& changes) {
  const auto& t = line.tokens;
  if (sets_kinematic_base(t)) return;
  if (t[0].is("MACHINE_DEF") || t[0].is("MACHINE_FRAME_DAT")) changes.robroot = true;
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (t[i].kind != Token::Kind::kWord || (i > 0 && sign_at(t, i - 1, '='))) continue;
    if (t[i].word == "TOOL_DATA") change(t, i, changes.tools);
    if (t[i].word == "BASE_DATA") change(t, i, changes.bases);
    if (t[i].word == "LOAD_DATA") change(t, i, changes.loads);
    if (t[i].word == "$ROBROOT" || t[i].word == "$WORLD" || t[i].word == "$NULLFRAME")
      changes.robroot = true;
  }
}

void merge(const FrameChanges& from, FrameChanges& into) {
  merge_numbers(from.tools, into.tools);
  merge_numbers(from.bases, into.bases);
  merge_numbers(from.loads, into.loads);
  into.robroot = into.robroot || from.robroot;
}

FrameChanges frame_changes(const std::vector<Line>& lines) {
  FrameChanges changes;
  for (const Line& line : lines) add_changes(line, changes);
  return changes;
}

}  // namespace cellcal::daemon::krl
