#pragma once
// What jumped in the middle of a session: one joint's zero (a belt or coupling that slipped, lost
// steps), the tip of the tool in the flange's frame (a tool that was knocked), or a target that was
// knocked or crept; planes and trackers have no centre to compare. The estimate puts each half-way
// and bends arm and targets a little, and one looks like another until they are asked side by side:
// with which of them undone are all touches likelier?

#include <vector>

#include "calib/estimate/options.h"
#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Looks closer: of every joint, the tool and every target the jump that explains most, touches
/// that were left out let in again; undone, and all identified anew. Likeliest first; none of what
/// explains next to nothing.
std::vector<Jump> jumps_by_odds(const Cell& cell, const std::vector<Touch>& touches,
                                const IdentifyOptions& options, const Calibration& calibration);

/// How likely the touches are, as they are told or with an error of the arm beside its model, which
/// touches of one posture share and those of like postures nearly so (discrepancy.h): the likelier.
/// Natural logarithm. What is said to have changed in the session has to be likelier than that.
double log_evidence_with_model(const Cell& cell, const std::vector<Touch>& touches,
                               const IdentifyOptions& options);
/// By which it has to be likelier to be believed.
inline constexpr double kBelievedOdds = 6.0;

/// Of these those that make the touches likelier by a clear margin than that nothing changed, and
/// that are not much less likely than the first.
std::vector<Jump> believed(std::vector<Jump> jumps);

/// Looks closer at the suspects in `calibration.moved`, whose place in the session is known. The
/// likeliest that is believed is all that it holds then, and the result is withheld; otherwise it
/// is emptied. `calibration` is of these touches.
void confirm_moves(const Cell& cell, const std::vector<Touch>& touches,
                   const IdentifyOptions& options, Calibration& calibration);

/// Withholds the result for a target that moved, and says so.
void withhold_for_move(const Cell& cell, const std::vector<Touch>& touches, const Jump& move,
                       Calibration& calibration);

/// Withholds the result for what `calibration.jumped` holds, and says what to do.
void withhold_for_jumps(const Cell& cell, const std::vector<Touch>& touches,
                        const IdentifyOptions& options, Calibration& calibration);

}  // namespace cellcal::calib
