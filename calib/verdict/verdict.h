#pragma once
// Verdict: permitted use of a result.

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "calib/estimate/estimate.h"
#include "calib/estimate/problem.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Requires everything except `verdict`, with gross check touches (held_out.h) marked among the
/// residuals. Withholding findings precede warnings and information.
Verdict judge(const Problem& problem, const Calibration& calibration);

/// Warns about a published result if a wrong contact that the other touches do not contradict could
/// shift the tip far beyond the prediction, (99).
void warn_of_unchecked_touch(std::span<const Touch> touches, Calibration& calibration);

// Targets, a joint or the tool that may have moved or jumped during the session: by the score test,
// without another solution. Candidates for examination only (calib/identify/jump.h).

/// Targets that may have been displaced or have crept, each with its most likely last touch before
/// the move, in descending order of evidence.
std::vector<MovedTarget> suspected_moves(const Problem& problem, const Estimate& estimate,
                                         double chi2_per_dof);

/// The joint or the tool whose jump would improve the fit most, and the approximate touch before
/// it; empty within chance.
std::vector<Jump> suspected_jump(const Problem& problem, const Estimate& estimate,
                                 double chi2_per_dof);

// Residuals of touches under the calibration that was in use when they were made: 'as found'.

struct FoundResiduals {
  ResidualSummary fit, check;
};

/// Residuals under `earlier` of touches of spheres that are not outliers. Places and effective
/// radius of the spheres are not errors of the arm: both are fitted to the fit touches, the radius
/// within its prior, as for `before` of a calibration (calib/verdict/residuals.h). Touches of other
/// targets are omitted. Empty if a touch belongs to a sphere or tool unknown to `earlier`, or no
/// sphere was touched.
std::optional<FoundResiduals> found_residuals(const Calibration& earlier,
                                              std::span<const Touch> touches,
                                              const std::vector<bool>& outlier);

}  // namespace cellcal::calib
