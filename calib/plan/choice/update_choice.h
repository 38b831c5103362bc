#pragma once
// Which candidates an update touches: those that take most from what it leaves open of the arm over the
// workspace, and of where the spheres stand.

#include <functional>
#include <vector>

#include "calib/plan/reach/candidates.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// `believed`: the mean over all explanations so far, with what it leaves open as its covariance. Up to `count`
/// indices into the candidates; `possible` is asked of one before it is picked.
std::vector<std::size_t> choose_update(const Calibration& believed,
                                       const std::vector<Candidate>& candidates, int count,
                                       const std::function<bool(std::size_t)>& possible);

}  // namespace cellcal::calib
