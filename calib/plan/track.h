#pragma once
// Positions of a linear unit from which the arm reaches a place, and how far off the tip may be there
// by the unit's prior, or by the arm's tolerances.

#include <Eigen/Core>
#include <optional>

#include "calib/model/kinematics.h"
#include "calib/model/linear.h"
#include "calib/plan/planned_touch.h"

namespace cellcal::calib {

/// A random one within the limits reduced by `margin_m`, no farther from the place than the arm with
/// its tool stretched out; the nearest one if none is. 0, without drawing, for an arm without linear
/// unit.
double track_position_m(const ArmModel& arm, const Eigen::Vector3d& place_m, double margin_m,
                        Random& random);

/// A place is known as it is seen with the carriage opposite to it, since it is taught or measured
/// from there: from elsewhere the tip is off by the errors of the way between. Nothing is added for
/// an arm without linear unit.
class TrackOff {
 public:
  struct Place {
    double opposite_m, beside_m;  ///< carriage opposite to it, within its limits; distance then
  };

  /// `robot`: with the priors of its unit.
  explicit TrackOff(const Robot& robot);
  bool any() const { return guide_.has_value(); }
  Place place(const Eigen::Vector3d& place_m) const;
  /// Three sigma of the tip in the worst direction [m]; convex in the carriage's position.
  double off_m(const Place& place, double carriage_m) const;
  /// The usual distance, root sum square with off_m(): (64a).
  double widened_m(double usual_m, const Eigen::Vector3d& place_m, const JointVector& q) const;

 private:
  std::optional<LinearGuide> guide_;
  Eigen::Vector3d along_, foot_m_;
  double min_m_ = 0.0, max_m_ = 0.0;
};

/// With arm_off_m of a large arm before it is calibrated: (64c).
PlanOptions with_tolerances(PlanOptions options, const Cell& cell);

/// Error of the nominal tip in one posture relative to others nearby, 1 sigma: that of (64c) where it is large,
/// otherwise kLeastArmSigmaM.
double arm_sigma_m(const Cell& cell);
inline constexpr double kLeastArmSigmaM = 0.002;

/// A search on both sides of the nominal surface, and the clear point: (64a), (64b), (64c).
struct SearchReach {
  double before_m, behind_m, clear_m;
  double within_m;  ///< of behind_m, without (64c)
};
SearchReach search_reach(const TrackOff& unit, const Target& target, const JointVector& contact,
                         const PlanOptions& options);

}  // namespace cellcal::calib
