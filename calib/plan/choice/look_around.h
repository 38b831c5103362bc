#pragma once
// A choice made better by candidates beside those that it picked.

#include <cstddef>

#include "calib/plan/choice/choose.h"
#include "calib/plan/reach/pool.h"

namespace cellcal::calib {

/// Of the time that a plan takes, so much is gone when it is known what the arm reaches, when touches are chosen,
/// and when they are exchanged for better ones; the ways are the rest.
inline constexpr double kReachShare = 0.05, kChosenShare = 0.15, kRefinedShare = 0.6;

/// Exchanges the picked for others like them, turned by ever smaller angles, as long as that brings
/// enough. `choice`: of the pool's candidates, by `how`. Those from `spread` on are forgotten, but
/// the picked.
void look_around(const Cell& cell, Pool& pool, std::size_t spread, ChooseOptions how,
                 Choice& choice);

}  // namespace cellcal::calib
