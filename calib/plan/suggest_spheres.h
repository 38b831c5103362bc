#pragma once
// Places for spheres that serve a region: where touches would leave least unknown of the arm.
//
// Possible places are tips of postures of the region that can be touched from many sides, clear of obstacles, floor
// and each other. All of them are put into one design (design.h), with certified lengths between them where the cell
// has any; a set of places is worth what a few touches of each take from the sum of position variances over the
// region. The set is chosen one place after the other and then by exchange. The touches of the set are planned as
// those of any cell, so that the figures are comparable with today's. Failure case: a region that the arm reaches, but
// around which no stand can be put, because of something that the cell file does not name.

#include <Eigen/Core>
#include <vector>

#include "calib/plan/plan.h"

namespace cellcal::calib {

struct SuggestedSpheres {
  Cell cell;  ///< today's, its spheres replaced; centres in the base frame [m], multiples of 10 mm
  Plan plan;  ///< of that cell
};

/// `count` spheres like the cell's first. `options.region` is the workspace or a box. Throws PlanError: the cell has no
/// sphere, the region is another (kRequest), or fewer places can be touched (kTooFew).
SuggestedSpheres suggest_spheres(const Cell& cell, const PlanOptions& options, int count);

}  // namespace cellcal::calib
