#pragma once
// A search and its retreat, in a form that outlives the session.
//
// Which postures near a sphere are clear depends on the contacts and misses of the session. If a
// session is aborted, or its process killed, the arm stays there, and the next session has the cell
// file only, by which the arm is inside the possible region of the sphere. It retreats by the moves
// recorded here, which were checked before the search.

#include <optional>
#include <string>
#include <vector>

#include "calib/model/joint_vector.h"

namespace cellcal::calib {

struct SearchUnderWay {
  std::string target;            ///< empty: no search, the arm returns
  std::vector<JointVector> way;  ///< from the starting position, via way-points, to the stand-off
  JointVector end;               ///< of the search; empty: none
  /// From the clear point, the first, to a posture from which any session can start. Empty: no path is
  /// known.
  std::vector<JointVector> out;

  bool operator==(const SearchUnderWay&) const = default;
};

/// Tolerance of each joint for an arm at rest on a move [rad]: 3.5 mm at 1 m, against 11 mm of clearance
/// of the tip.
inline constexpr double kOnWayRad = 0.0035;

/// Way-points from `at` on, by the recorded moves only; empty if the arm is not on them, or they have no
/// retreat.
std::optional<std::vector<JointVector>> way_out_of(const SearchUnderWay& left,
                                                   const JointVector& at);

}  // namespace cellcal::calib
