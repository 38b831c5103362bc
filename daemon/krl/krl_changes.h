#pragma once
// Which of the controller's tools, bases and loads a program changes itself: what $config.dat says of
// them need not hold at any of its motions, wherever the line stands.

#include <set>
#include <vector>

#include "calib/export/krl_text.h"

namespace cellcal::daemon::krl {

using namespace calib::krl;

struct ChangedNumbers {
  bool all = false;  ///< the number is computed
  std::set<int> numbers;
  bool has(int number) const { return number > 0 && (all || numbers.count(number) > 0); }
};

struct FrameChanges {
  ChangedNumbers tools, bases, loads;
  bool robroot = false;
};

/// All but TOOL_DATA[n] and its like right behind '=' count as a change: assignments, components, OUT
/// parameters, and declarations that hide the controller's.
FrameChanges frame_changes(const std::vector<Line>& lines);
void add_changes(const Line& line, FrameChanges& changes);
void merge(const FrameChanges& from, FrameChanges& into);

}  // namespace cellcal::daemon::krl
