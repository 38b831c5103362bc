#pragma once
// Jumps during a session: of one joint's zero (a belt or coupling that slipped, lost steps), of the
// tip of the tool in the flange's frame (a collision of the tool), or of a target that was
// displaced or crept; planes have no place to compare. The estimate averages both
// positions and distorts arm and targets slightly, and the kinds of jump resemble each other. They
// are therefore compared by the likelihood of all touches with each of them undone.

#include <vector>

#include "calib/estimate/options.h"
#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// For every joint, the tool and every target: the jump that explains most, with excluded touches
/// readmitted, followed by an identification with the jump undone. Likeliest first; without those
/// of negligible effect. `calibration` is that of the touches.
std::vector<Jump> jumps_by_odds(const Cell& cell, const std::vector<Touch>& touches,
                                const IdentifyOptions& options, const Calibration& calibration);

/// Log evidence of the touches as stated or with a model discrepancy, which touches of one posture
/// share and those of similar postures nearly so (discrepancy.h); the larger one. A reported change
/// during the session must exceed it.
double log_evidence_with_model(const Cell& cell, const std::vector<Touch>& touches,
                               const IdentifyOptions& options);
/// Log odds above which a change is accepted.
inline constexpr double kConfirmedOdds = 6.0;

/// Displacement of the tip that the bounds of a result include: its predicted error near the targets;
/// 0 if it is withheld anyway, since any jump may be the cause.
double covered_m(const Calibration& calibration);

/// Accepted jumps: clearly likelier than no change, not much less likely than the first, and
/// displacing the tip by more than `covered_m`. `jumps`: likeliest first.
std::vector<Jump> confirmed_jumps(const Cell& cell, const std::vector<Touch>& touches,
                                  double covered_m, std::vector<Jump> jumps);

/// Tests the suspects in `calibration.moved`, whose place in the session is known, as
/// confirmed_jumps() does. Keeps the likeliest accepted one and withholds the result; clears `moved` if none is accepted.
/// `calibration` is that of the touches.
void confirm_moves(const Cell& cell, const std::vector<Touch>& touches,
                   const IdentifyOptions& options, double covered_m, Calibration& calibration);

/// Withholds the result for a moved target, and adds the finding.
void withhold_for_move(const Cell& cell, const std::vector<Touch>& touches, const Jump& move,
                       Calibration& calibration);

/// Withholds the result for `calibration.jumped`, and adds the finding with the remedy.
void withhold_for_jumps(const Cell& cell, const std::vector<Touch>& touches,
                        const IdentifyOptions& options, Calibration& calibration);

}  // namespace cellcal::calib
