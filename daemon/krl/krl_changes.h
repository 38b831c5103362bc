#pragma once
// Tools, bases and loads of the controller that programs change: their values in $config.dat may be
// invalid at any motion, regardless of the line's position (AssignedFrame of krl_program.h aside).

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "calib/export/krl_values.h"

namespace cellcal::daemon::krl {

using namespace calib::krl;

struct ChangePlace {
  std::string file;
  int line = 0;
};

struct ChangedNumbers {
  std::map<int, ChangePlace> numbers;
  /// Files that compute the number, with their first such line.
  std::map<std::string, int> computed;
  /// Place of a possible change.
  std::optional<ChangePlace> of(int number) const;
  std::optional<ChangePlace> any() const;
};

struct FrameChanges {
  ChangedNumbers tools, loads;
  ChangedNumbers bases;     ///< BASE_DATA[n], MACHINE_FRAME_DAT[n]
  ChangedNumbers machines;  ///< MACHINE_DEF[n]
  std::optional<ChangePlace> robroot;
};

/// Names of routines that change none of their arguments.
using Readers = std::set<std::string>;
/// Changes are assignments other than of the value that `stated` has, arguments of routines other than `readers` and KUKA's that only read, and declarations that
/// hide the controller's.
FrameChanges frame_changes(const std::vector<Line>& lines, const std::string& file,
                           const Readers& readers, const ControllerFrames& stated);
void add_changes(const Line& line, const std::string& file, const Readers& readers,
                 const ControllerFrames& stated, FrameChanges& changes);
/// True if the line may change the variable, or a component of it, at tokens[at]: assigns it, hides it by a declaration,
/// or hands it to a routine other than `readers` and KUKA's that only read.
bool changes_at(const Line& line, std::size_t at, const Readers& readers);
/// $BASE=EK(MACHINE_DEF[n].ROOT,...): reads what it names.
bool sets_kinematic_base(const std::vector<Token>& tokens);
/// The places of `into` stay.
void merge(const FrameChanges& from, FrameChanges& into);
/// The controller rounds frames: equal to 0.0005 mm and deg.
bool same_frame(const calib::FrameMmDeg& a, const calib::FrameMmDeg& b);
/// Per number, what each statement that changes it makes it; empty: not written out.
struct ChangedFrames {
  std::map<int, std::vector<std::optional<calib::FrameMmDeg>>> tools, bases;
};
void add_changed_frames(const std::vector<Line>& lines, const Readers& readers,
                        ChangedFrames& changed);
/// Without those of a computed number, which may be any.
FrameChanges of_stated_numbers(FrameChanges changes);

}  // namespace cellcal::daemon::krl
