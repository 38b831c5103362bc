#pragma once
// The arm and its tool as capsules on the nominal geometry. A body's axis is the straight line from
// its joint to the next one; the tool's shaft goes straight from the flange to where its slim end
// begins, and the slim end to the TCP. Other tools on the flange are two bodies each.

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
  std::string words;          ///< "the forearm (A4)"
  int joint = 0;              ///< the last joint that moves it
  double radius_m = 0.0;      ///< about its axis
  bool is_tip = false;        ///< the slim end, or the ball at its end
  bool meets_cell = true;     ///< the column stands where it stands, whatever is beside it
  std::vector<double> lever;  ///< per joint: no point of the axis moves further per radian [m]
};

/// What the links' radii are taken to be where the robot file states none: 0.10 m for an arm of
/// 1.34 m from shoulder to flange (the castings of a KR 5), in proportion for others, because
/// castings grow with the arm; at least 0.06 m, because the gears of the smallest do not shrink.
double assumed_radius_m(const Robot& robot);

class Bodies {
 public:
  /// `arm` is referred to.
  explicit Bodies(const ArmModel& arm);

  const std::vector<Body>& list() const { return list_; }
  /// Axes of all bodies at this posture, in the order of list().
  void place(std::span<const double> q, std::vector<Segment>& axes) const;

 private:
  const ArmModel& arm_;
  ArmErrors nominal_;
  std::vector<Body> list_;
  bool has_shaft_ = false, has_ball_ = false;
  double back_m_ = 0.0;  ///< the slim end's axis ends this far behind the TCP: its nose is round
};

/// Distance of two segments [m]; either may be a point.
double distance_m(const Segment& one, const Segment& other);

}  // namespace cellcal::calib
