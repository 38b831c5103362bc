#pragma once
// A search and the way out of it, in a form that outlives the session that makes it.
//
// Which postures near a sphere are clear follows from what a session has met and missed. A session
// that is aborted, or whose process is killed, leaves the arm there, and the next one knows the cell
// file alone: to it the arm stands where the sphere may be. It leaves by the moves recorded here, which
// were found clear before the arm went there.

#include <optional>
#include <string>
#include <vector>

#include "calib/model/joint_vector.h"

namespace cellcal::calib {

struct SearchUnderWay {
  std::string target;            ///< empty: nothing is searched, the arm goes home
  std::vector<JointVector> way;  ///< from where the arm stood, over way-points, to the stand-off
  JointVector end;               ///< of the search; empty: none
  /// From the clear point, the first, to a posture from which any session can begin. Empty: no way is known.
  std::vector<JointVector> out;

  bool operator==(const SearchUnderWay&) const = default;
};

/// No joint of an arm at rest on a move is farther from it [rad]: 3.5 mm at 1 m, and 11 mm are kept clear
/// of the tip.
inline constexpr double kOnWayRad = 0.0035;

/// Way-points from `at` on, by the recorded moves alone; empty where the arm is on none of them, or they
/// lead nowhere.
std::optional<std::vector<JointVector>> way_out_of(const SearchUnderWay& left,
                                                   const JointVector& at);

}  // namespace cellcal::calib
