#pragma once
// What jumped in the middle of a session: one joint's zero (a belt or coupling that slipped, lost
// steps), the tip of the tool in the flange's frame (a tool that was knocked), or a target
// (moved.h). The estimate puts each half-way and bends arm and targets a little, and one looks like
// another until they are asked side by side: with which of them undone are all touches likelier?

#include <string>
#include <vector>

#include "calib/identify/calibration.h"
#include "calib/identify/estimate.h"
#include "calib/identify/identify.h"
#include "calib/identify/problem.h"

namespace cellcal::calib {

/// The joint or the tool whose jump would improve the fit most, and after which touch about; none
/// where it is no more than chance. From the linearisation, without solving anew: a reason to look
/// closer, no more.
std::vector<Jump> suspected_jump(const Problem& problem, const Estimate& estimate,
                                 double chi2_per_dof);

/// Looks closer: of every joint, the tool and every target the jump that explains most, touches
/// that were left out let in again; undone, and all identified anew. Likeliest first; none of what
/// explains next to nothing.
std::vector<Jump> jumps_by_odds(const Cell& cell, const std::vector<Touch>& touches,
                                const IdentifyOptions& options, const Calibration& calibration);

/// Of these those that make the touches likelier by a clear margin than that nothing changed, and
/// that are not much less likely than the first.
std::vector<Jump> believed(std::vector<Jump> jumps);

/// Withholds the result for what `calibration.jumped` holds, and says what to do.
void tell_of_jumps(const Cell& cell, const std::vector<Touch>& touches,
                   const IdentifyOptions& options, Calibration& calibration);

}  // namespace cellcal::calib
