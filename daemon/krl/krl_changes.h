#pragma once
// Tools, bases and loads of the controller that a program changes itself: their values in
// $config.dat may be invalid at any of its motions, regardless of the line's position.

#include <set>
#include <vector>

#include "calib/export/krl_text.h"

namespace cellcal::daemon::krl {

using namespace calib::krl;

struct ChangedNumbers {
  bool all = false;  ///< computed number
  std::set<int> numbers;
  bool has(int number) const { return number > 0 && (all || numbers.count(number) > 0); }
};

struct FrameChanges {
  ChangedNumbers tools, bases, loads;
  bool robroot = false;
};

/// Every use other than TOOL_DATA[n] and the like directly after '=' counts as a change:
/// assignments, components, OUT parameters, and declarations that hide the controller's.
FrameChanges frame_changes(const std::vector<Line>& lines);
void add_changes(const Line& line, FrameChanges& changes);
/// $BASE=EK(MACHINE_DEF[n].ROOT,...): reads what it names.
bool sets_kinematic_base(const std::vector<Token>& tokens);
void merge(const FrameChanges& from, FrameChanges& into);

}  // namespace cellcal::daemon::krl
