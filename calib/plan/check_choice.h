#pragma once
// Which candidates a check touches: those that leave a shift of the tool least unknown, were nothing else
// changed and were everything else a little.

#include <functional>
#include <vector>

#include "calib/plan/candidates.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// `count` indices into the candidates, every target among them once where there are enough. `possible`: asked
/// of a candidate before it is picked. Fewer where no more are possible.
std::vector<std::size_t> choose_check(const Calibration& calibration,
                                      const std::vector<Candidate>& candidates, int count,
                                      const std::function<bool(std::size_t)>& possible);

// Which candidates an update touches: those that take most from what it leaves open of the arm over the
// workspace, and of where the spheres stand.

/// `believed`: the mean over all explanations so far, with what it leaves open as its covariance. Up to `count`
/// indices into the candidates; `possible` is asked of one before it is picked.
std::vector<std::size_t> choose_update(const Calibration& believed,
                                       const std::vector<Candidate>& candidates, int count,
                                       const std::function<bool(std::size_t)>& possible);

}  // namespace cellcal::calib
