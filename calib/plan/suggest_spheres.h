#pragma once
// Suggests places of spheres for a region: those with the smallest remaining uncertainty of the arm.
//
// Possible places are tips of postures of the region that can be touched from many sides, clear of obstacles, floor
// and each other. All of them form one design (design.h), with certified lengths between them if the cell has any; the
// value of a set of places is the reduction of the sum of position variances over the region by a few touches of each.
// The set is chosen greedily and then by exchange. Its touches are planned as for any cell, so that the figures are
// comparable with the current ones. Failure case: a reachable region without room for stands, because of objects
// missing from the cell file.

#include <Eigen/Core>
#include <vector>

#include "calib/plan/plan.h"

namespace cellcal::calib {

struct SuggestedSpheres {
  Cell cell;  ///< current cell, spheres replaced; centres in the base frame [m], multiples of 10 mm
  Plan plan;  ///< of that cell
};

/// `count` spheres like the cell's first. `options.region` is the workspace or a box. Throws PlanError: no sphere in
/// the cell, another region (kRequest), or too few touchable places (kTooFew).
SuggestedSpheres suggest_spheres(const Cell& cell, const PlanOptions& options, int count);

}  // namespace cellcal::calib
