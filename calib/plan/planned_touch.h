#pragma once
// A touch as the arm makes it, a plan of them, and what every planner is told.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calib/model/error.h"
#include "calib/model/joint_vector.h"
#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/plan/accuracy_region.h"

namespace cellcal::calib {

// A way-point that need not be visited.

/// Shares of the leg that leads to a way-point and of the one that leads on. Between the points on
/// the legs that are this far from it and the way-point itself (their triangle, in joint space) the
/// arm may go as it likes. 0: it has to go to the way-point.
struct Corner {
  double in_share = 0.0, out_share = 0.0;
};
inline constexpr double kMostCornerShare = 0.5;

/// Tip path [m] from its stand-off, along its search, to the contact.
struct ExpectedContact {
  double travel_m = 0.0;
  double sigma_m = 0.0;  ///< 1 sigma; 0: not known better than by nominal geometry
};

struct PlannedTouch {
  std::string target;
  TouchSet set = TouchSet::kFit;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< outward at the contact, base frame
  std::vector<JointVector> transit;  ///< waypoints from the previous clear point; ends at standoff
  /// One for each waypoint; the last is the stand-off's, on the way on along the search line. Empty:
  /// the arm stops at each.
  std::vector<Corner> corners;
  Corner leaving;  ///< where the transit begins, for an arm that comes along the last search line
  JointVector standoff;
  JointVector end;                ///< end of the search: no contact by here is a failure
  JointVector clear;              ///< where the arm goes after the touch
  double search_m = 0.0;          ///< tip path from standoff to end
  double expected_m = 0.0;        ///< tip path from standoff to where the surface is expected
  double expected_sigma_m = 0.0;  ///< as ExpectedContact's
  double search_m_s = 0.0;  ///< speed of its first search; 0: as the session's touches have it
  bool may_miss = false;    ///< looks for a sphere: no contact by the end is an answer
};

struct Plan {
  JointVector start;  ///< where the arm must be (or is first moved to) before the first transit
  std::vector<PlannedTouch> touches;
  std::vector<JointVector> home;      ///< waypoints from the last clear point back to start
  std::vector<std::string> left_out;  ///< ids of targets of which no touches are planned
  double predicted_mean_m = 0.0;      ///< mean 3-D error over the region that the plan should reach
  double predicted_u95_m = 0.0;  ///< mean over it of the radius that holds it; 0: not predicted
};

/// How touches are chosen.
enum class Criterion {
  kI,      ///< the least mean variance of position over the region that matters
  kD,      ///< the most information on all unknowns together
  kEven,   ///< targets in turn, directions and postures far apart
  kRandom  ///< any
};

struct PlanOptions {
  int fit_touches = 40;
  int check_touches = 10;
  unsigned seed = 1;
  double standoff_m = 0.012;  ///< an uncalibrated arm is wrong by up to 10 mm
  double beyond_m = 0.012;    ///< search continues this far past the nominal surface
  double clear_m = 0.020;     ///< retreat distance from the surface
  double limit_margin_rad = 0.05;
  Criterion criterion = Criterion::kI;
  AccuracyRegion region;
};

}  // namespace cellcal::calib
