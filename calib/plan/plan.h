#pragma once
// Plans touches, their order, and the paths between them, on nominal geometry.
//
// Touches are planned for spheres, and for planes that state centre, normal and extent; others are
// made by hand (candidates.h). A touch: the tip starts at the stand-off, searches along the inward
// normal to the end of the search, and retreats to the clear point. All positions are joint angles;
// the hardware layer uses nothing else. Every posture in a plan is inside the robot's limits with
// margin, and no motion collides with an object of the cell file or with the arm itself
// (clearance.h); only the tip meets the sphere that it touches.

#include <Eigen/Core>
#include <vector>

#include "calib/plan/planned_touch.h"

namespace cellcal::calib {

/// Throws PlanError. `from`: current position; empty: the plan's own start.
Plan make_plan(const Cell& cell, const PlanOptions& options, const JointVector& from = {});

/// The same plan resumed at touch `next` with the arm at `from`: only the transit to that touch
/// changes. If `from` lies on a search line, the first waypoint leads back out of it; `in_contact`, it
/// has to lie on one, since no other way is known to lead away. Throws PlanError if no clear path is
/// found; the operator has to jog the arm.
///
/// `positioner_rad`: the positioner's present angles. Unless they are the touch's setting, the arm
/// goes to the plan's start first, and they turn there. Within 0.12 deg they stay.
Plan resume_plan(const Cell& cell, const Plan& plan, std::size_t next, const JointVector& from,
                 bool in_contact, const std::vector<double>& positioner_rad = {});

// Suggests places of spheres for a region: those with the smallest remaining uncertainty of the arm.
//
// Possible places are tips of postures of the region that can be touched from many sides, clear of obstacles, floor
// and each other. All of them form one design (design.h), with certified lengths between them if the cell has any; the
// value of a set of places is the reduction of the sum of position variances over the region by a few touches of each.
// The set is chosen greedily and then by exchange. Its touches are planned as for any cell, so that the figures are
// comparable with the current ones. Failure case: a reachable region without room for stands, because of objects
// missing from the cell file.

struct SuggestedSpheres {
  Cell cell;  ///< current cell, spheres replaced; centres in the base frame [m], multiples of 10 mm
  Plan plan;  ///< of that cell
};

/// `count` spheres like the cell's first. `options.region` is the workspace or a box. Throws PlanError: no sphere in
/// the cell, another region (kRequest), or too few touchable places (kTooFew).
SuggestedSpheres suggest_spheres(const Cell& cell, const PlanOptions& options, int count);

}  // namespace cellcal::calib
