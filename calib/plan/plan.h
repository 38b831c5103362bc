#pragma once
// Which touches to make, in which order, and how to get from one to the next, on nominal geometry.
//
// Touches are planned of spheres, and of planes that state centre, normal and extent; others are
// made by hand (candidates.h). A touch: the tip starts at the stand-off, searches along the inward
// normal to the end of the search, and afterwards leaves to the clear point. All positions are
// joint angles; the hardware layer knows nothing else. Every joint angle in a plan is inside the
// robot's limits with margin, and nothing of arm and tool hits on any motion what the cell file
// names, or the arm itself (clearance.h); the tip alone meets the sphere that it touches.

#include "calib/plan/planned_touch.h"

namespace cellcal::calib {

/// Throws PlanError. `from` is where the arm is now; empty: the plan's own start.
Plan make_plan(const Cell& cell, const PlanOptions& options, const JointVector& from = {});

/// The same plan, to be gone on with at touch `next` with the arm at `from`: only the transit to
/// that touch changes. If `from` lies on a search line, the first waypoint leads back out of it.
/// Throws PlanError when no clear way is found from there: the operator has to jog the arm.
Plan resume_plan(const Cell& cell, const Plan& plan, std::size_t next, const JointVector& from);

}  // namespace cellcal::calib
