#pragma once
// Choice of a check's touches: minimises the uncertainty of a shift of the tool, both with everything
// else unchanged and with small changes of everything else.

#include <functional>
#include <string>
#include <vector>

#include "calib/plan/candidates.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// `count` indices of candidates, with every target at least once if possible. `possible`: called for a
/// candidate before it is picked. Fewer if no more are feasible.
std::vector<std::size_t> choose_check(const Calibration& calibration,
                                      const std::vector<Candidate>& candidates, int count,
                                      const std::function<bool(std::size_t)>& possible);

/// Likewise, of the zeros of these joints.
std::vector<std::size_t> choose_for_zeros(const Calibration& calibration,
                                          const std::vector<std::string>& joints,
                                          const std::vector<Candidate>& candidates, int count,
                                          const std::function<bool(std::size_t)>& possible);

// Choice of an update's touches: minimises the remaining uncertainty of the arm over the workspace, and
// of the spheres' centres.

/// `believed`: mean over all current explanations, with their spread in its covariance. Up to `count` indices
/// of candidates; `possible` is called for each before it is picked.
std::vector<std::size_t> choose_update(const Calibration& believed,
                                       const std::vector<Candidate>& candidates, int count,
                                       const std::function<bool(std::size_t)>& possible);

}  // namespace cellcal::calib
