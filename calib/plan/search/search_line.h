#pragma once
// A search for a sphere as the arm is led along it: straight in joint space, and so never straight
// in space. An arm of 1.1 m bows by 1.5 mm on 9 cm, and where a sphere may be is 20 cm across: the
// ends are put beside the line by half of the bow, to the side away from it, so that the tip passes
// the line on both sides, and the search may be longer by 1.4.

#include <Eigen/Geometry>
#include <optional>

#include "calib/model/kinematics.h"

namespace cellcal::calib {

/// The tip may leave its line by so much.
inline constexpr double kMostBowM = 0.0015;

struct LineToLead {
  Eigen::Vector3d aim_m, normal;  ///< as of a SearchLine, base frame
  Eigen::Matrix3d orientation;    ///< of the TCP
  JointVector near;               ///< a posture about there
};

/// From the aim along the normal, the farthest first.
struct LineEnds {
  double clear_m, standoff_m, end_m;
};

struct LedSearch {
  Eigen::Vector3d from, to;  ///< the line, from the stand-off to the end
  JointVector clear, standoff, end;
  double expected_m = 0.0;  ///< on the way, where it is met at about; set by who knows
};

/// Unit, from the flange to the tip, in the TCP's frame.
Eigen::Vector3d shaft_in_tool(const Tool& tool);

class LineLeader {
 public:
  /// Both are referred to.
  LineLeader(const ArmModel& arm, const Tool& tool, double limit_margin_rad)
      : arm_(arm), tool_(tool), margin_rad_(limit_margin_rad) {}

  /// Empty where the arm does not reach it, or does not keep to the line: its tip within kMostBowM,
  /// the end of its shaft within twice that, no joint far from where it began.
  std::optional<LedSearch> lead(const LineToLead& line, const LineEnds& ends) const;
  /// Of the tip half way of a move, across the straight line between its ends.
  Eigen::Vector3d bow_m(const JointVector& from, const JointVector& to) const;

 private:
  std::optional<JointVector> posture(const LineToLead& line, double outside_m,
                                     const Eigen::Vector3d& beside, const JointVector& near) const;
  Eigen::Vector3d on_move(const JointVector& from, const JointVector& to, double share,
                          double behind_tip_m) const;
  bool keeps_to(const LineToLead& line, const LedSearch& led) const;

  const ArmModel& arm_;
  const Tool& tool_;
  double margin_rad_;
};

}  // namespace cellcal::calib
