#pragma once
// Which candidates a check touches: those that leave a shift of the tool least unknown, were nothing else
// changed and were everything else a little.

#include <functional>
#include <vector>

#include "calib/plan/reach/candidates.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// `count` indices into the candidates, every target among them once where there are enough. `possible`: asked
/// of a candidate before it is picked. Fewer where no more are possible.
std::vector<std::size_t> choose_check(const Calibration& calibration,
                                      const std::vector<Candidate>& candidates, int count,
                                      const std::function<bool(std::size_t)>& possible);

}  // namespace cellcal::calib
