#pragma once
// Arm and tool as capsules on the nominal geometry. A body's axis is the straight line from its
// joint to the next one; the tool's shaft extends straight from the flange to the slim end, and the
// slim end to the TCP. Further tools on the flange are two bodies each. A linear unit's carriage is a
// ball about the arm's foot; the column that it moves begins above it.

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "calib/model/joint_vector.h"
#include "calib/model/kinematics.h"

namespace cellcal::calib {

struct Segment {
  Eigen::Vector3d a, b;  ///< base frame
};

struct Body {
  std::string words;      ///< "the forearm (A4)"
  int joint = 0;          ///< last joint that moves it
  double radius_m = 0.0;  ///< about its axis
  bool is_tip = false;    ///< the slim end, or the ball at its end
  /// Of the fixed foot of the arm or its linear unit false: regardless of what is next to it.
  bool meets_cell = true;
  std::vector<double> lever =
      {};                ///< per joint: bound of the axis' motion per radian [m], or metre
  bool assumed = false;  ///< radius_m is not stated
};

/// Assumed radius of links without a stated one: 0.10 m for an arm of 1.34 m from shoulder to
/// flange (the castings of a KR 5), in proportion for others, because castings grow with the arm;
/// at least 0.06 m, because the gears of the smallest do not shrink.
double assumed_radius_m(const Robot& robot);

class Bodies {
 public:
  /// Refers to `arm`.
  explicit Bodies(const ArmModel& arm);

  const std::vector<Body>& list() const { return list_; }
  /// Axes of all bodies in this posture, in the order of list().
  void place(std::span<const double> q, std::vector<Segment>& axes) const;

 private:
  const ArmModel& arm_;
  ArmErrors nominal_;
  std::vector<Body> list_;
  bool has_shaft_ = false, has_ball_ = false;
  double back_m_ = 0.0;  ///< from the TCP to the end of the slim end's axis: round tip
};

/// Distance between two segments [m]; either may be a point.
double distance_m(const Segment& one, const Segment& other);

}  // namespace cellcal::calib
