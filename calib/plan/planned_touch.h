#pragma once
// A planned touch, a plan of touches, and the options of all planners.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/error.h"
#include "calib/model/joint_vector.h"
#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/plan/accuracy_region.h"
#include "calib/plan/missing.h"

namespace cellcal::calib {

// A way-point that need not be visited exactly.

/// Shares of the legs before and after a way-point. Within the triangle, in joint space, of the
/// way-point and the points on the legs at these shares, the arm may take any path. 0: it must
/// reach the way-point.
struct Corner {
  double in_share = 0.0, out_share = 0.0;
};
inline constexpr double kMostCornerShare = 0.5;

/// Tip path [m] from the stand-off, along the search, to the contact.
struct ExpectedContact {
  double travel_m = 0.0;
  double sigma_m = 0.0;  ///< 1 sigma; 0: nominal geometry only
};

struct PlannedTouch {
  std::string target;
  TouchSet set = TouchSet::kFit;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< outward at the contact, base frame
  /// Waypoints from the previous clear point, or where the arm waited; ends at standoff.
  std::vector<JointVector> transit;
  /// One per waypoint; the last is at the stand-off, towards the search line. Empty: the arm stops
  /// at each.
  std::vector<Corner> corners;
  Corner leaving;  ///< at the start of the transit, for an arm arriving along the last search line
  JointVector standoff;
  JointVector end;                ///< end of the search: no contact up to here is a failure
  JointVector clear;              ///< destination after the touch
  double search_m = 0.0;          ///< tip path from standoff to end
  double expected_m = 0.0;        ///< tip path from standoff to the expected surface
  double expected_sigma_m = 0.0;  ///< as in ExpectedContact
  double search_m_s = 0.0;        ///< speed of its first search; 0: the session's default
  /// Angles of the positioner's axes. They turn from `wait_rad` while the arm rests at the end of
  /// `wait`, before the transit.
  std::vector<double> positioner_rad;
  std::vector<JointVector> wait;  ///< waypoints from the previous clear point; empty: they stand
  std::vector<double> wait_rad;   ///< angles of the positioner's axes on that way
  bool may_miss = false;          ///< searches for a sphere: no contact is a valid result
};

struct Plan {
  JointVector start;  ///< required position before the first transit
  std::vector<PlannedTouch> touches;
  std::vector<JointVector> home;  ///< waypoints from the last clear point back to start
  /// Angles of the positioner's axes on that way, of a plan without touches.
  std::vector<double> home_rad{};
  std::vector<std::string> left_out;  ///< ids of targets without planned touches
  double predicted_mean_m = 0.0;      ///< predicted mean 3-D error over the region
  double predicted_u95_m = 0.0;       ///< mean of its 95 % radius; 0: not predicted
  std::optional<Missing> missing{};   ///< what keeps u95 above the goal asked for
};

/// Criterion for the choice of touches.
enum class Criterion {
  kI,      ///< smallest mean position variance over the region of interest
  kD,      ///< largest joint information on all unknowns
  kEven,   ///< targets in turn, directions and postures far apart
  kRandom  ///< random
};

struct PlanOptions {
  int fit_touches = kUsualTouches;  ///< with a goal the most
  /// u95, mean over the region, for which as few touches as it is predicted to take are planned; 0:
  /// all of them.
  double goal_u95_m = 0.0;
  int check_touches = kUsualChecks;
  unsigned seed = 1;
  double standoff_m = 0.012;  ///< an uncalibrated arm is off by up to 10 mm
  double beyond_m = 0.012;    ///< search continues this far past the nominal surface
  double clear_m = 0.020;     ///< retreat distance from the surface
  double arm_off_m = 0.0;     ///< of the tip, by the arm's tolerances: with_tolerances()
  double limit_margin_rad = 0.05;
  Criterion criterion = Criterion::kI;
  AccuracyRegion region;
};

}  // namespace cellcal::calib
