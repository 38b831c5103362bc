#pragma once
// A search for a sphere as the arm is led along it: straight in joint space, and so never straight
// in space. An arm of 1.1 m bows by 1.5 mm on 9 cm, and where a sphere may be is 20 cm across: the
// ends are put beside the line by half of the bow, to the side away from it, so that the tip passes
// the line on both sides, and the search may be longer by 1.4.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>
#include <optional>
#include <vector>

#include "calib/model/kinematics.h"
#include "calib/model/robot.h"

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

// How deep a search for a sphere may go, and how likely it meets it.

struct SearchLine {
  Eigen::Vector3d aim_m;   ///< a point that the line goes through, base frame
  Eigen::Vector3d normal;  ///< unit, against the direction of search
  Eigen::Vector3d shaft;   ///< unit, from the shaft's end to the tip
};

/// What the sphere stands on: a post straight below its centre, however long.
struct SearchStand {
  Eigen::Vector3d up;     ///< unit
  double radius_m = 0.0;  ///< 0: none
};

struct SearchDepth {
  double end_m = 0.0;  ///< of the tip, from the aim along the normal; negative: behind it
  double share = 0.0;  ///< of the places whose sphere the tip meets before
  /// Of each place, where the tip meets it, from the aim along the normal; kNeverM: not before the
  /// end.
  std::vector<double> met_m{};
};

inline constexpr double kNeverM = -std::numeric_limits<double>::max();

/// The tip may go as far as the shaft stays clear of every sphere that the tip does not surely meet
/// first (by 5 mm: arms are off), as tip and shaft stay clear of every stand of such a sphere, and
/// no farther than there is anything to be met. `radius_m`: of the sphere.
SearchDepth search_depth(const SearchLine& line, const std::vector<Eigen::Vector3d>& places,
                         double radius_m, const SearchStand& stand, const Tool& tool);

/// How much of the variance of the centre [m^2, sum of three components] the outcome of the search
/// is expected to take away, contact and its depth or none, where depths are off by `sigma_m`.
double told_m2(const SearchDepth& depth, const std::vector<Eigen::Vector3d>& places,
               double sigma_m);

}  // namespace cellcal::calib
