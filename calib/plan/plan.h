#pragma once
// Which touches to make, in which order, and how to get from one to the next, on nominal geometry.
//
// Touches are planned of spheres, and of planes that state centre, normal and extent; others are
// made by hand (candidates.h). A touch: the tip starts at the stand-off, searches along the inward
// normal to the end of the search, and afterwards leaves to the clear point. All positions are
// joint angles; the hardware layer knows nothing else. Every joint angle in a plan is inside the
// robot's limits with margin, and nothing of arm and tool hits on any motion what the cell file
// names, or the arm itself (clearance.h); the tip alone meets the sphere that it touches.

#include <Eigen/Core>
#include <stop_token>
#include <string>
#include <vector>

#include "calib/model/error.h"
#include "calib/model/joint_vector.h"
#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/plan/interest.h"

namespace cellcal::calib {

struct PlannedTouch {
  std::string target;
  TouchSet set = TouchSet::kFit;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< outward at the contact, base frame
  std::vector<JointVector> transit;  ///< waypoints from the previous clear point; ends at standoff
  JointVector standoff;
  JointVector end;          ///< end of the search: no contact by here is a failure
  JointVector clear;        ///< where the arm goes after the touch
  double search_m = 0.0;    ///< tip path from standoff to end
  double expected_m = 0.0;  ///< tip path from standoff to the nominal surface
  bool may_miss = false;    ///< looks for a sphere: no contact by the end is an answer
};

struct Plan {
  JointVector start;  ///< where the arm must be (or is first moved to) before the first transit
  std::vector<PlannedTouch> touches;
  std::vector<JointVector> home;      ///< waypoints from the last clear point back to start
  std::vector<std::string> left_out;  ///< ids of targets of which no touches are planned
  double predicted_m3_m = 0.0;        ///< mean 3-D error over the region that the plan should reach
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
  Interest interest;
  std::stop_token stop{};  ///< once asked for, whatever plans with these throws PlanError soon
};

/// Throws PlanError where `stop` was asked for.
void check_wanted(const std::stop_token& stop);

/// Throws PlanError. `from` is where the arm is now; empty: the plan's own start.
Plan make_plan(const Cell& cell, const PlanOptions& options, const JointVector& from = {});

/// The same plan, to be gone on with at touch `next` with the arm at `from`: only the transit to
/// that touch changes. If `from` lies on a search line, the first waypoint leads back out of it.
/// Throws PlanError when no clear way is found from there: the operator has to jog the arm.
Plan resume_plan(const Cell& cell, const Plan& plan, std::size_t next, const JointVector& from);

}  // namespace cellcal::calib
