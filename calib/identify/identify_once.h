#pragma once
// Single-pass identification of one set of touches, with cell file and touches as stated: estimate,
// uncertainties, consistency, verdict. The diagnosis of a withheld result (calib/identify) repeats
// it for each hypothesis.

#include <string>
#include <variant>
#include <vector>

#include "calib/estimate/options.h"
#include "calib/model/error.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Identifies without diagnosis. Throws IdentifyError if there are no usable touches or they lead
/// to no calibration.
/// `richer`: also bearings and functions of the joint angles, by evidence. Hypotheses of a diagnosis
/// are tested without: a richer arm absorbs mistakes.
Calibration identify_single_pass(const Cell& cell, const std::vector<Touch>& touches,
                                 const IdentifyOptions& options = {}, bool richer = false);

/// As identify_single_pass(), but returns the error if there is no calibration.
std::variant<Calibration, IdentifyError> identified_or_why_not(const Cell& cell,
                                                               const std::vector<Touch>& touches,
                                                               const IdentifyOptions& options = {},
                                                               bool richer = false);

/// The nominal arm, withheld for the reason `why`. Throws IdentifyError if there is nothing to
/// identify from.
Calibration not_identified(const Cell& cell, const std::vector<Touch>& touches,
                           const IdentifyOptions& options, const std::string& why);

/// Throws IdentifyError if there are no fit touches, or an angle is not finite.
void require_sound(const Cell& cell, const std::vector<Touch>& touches);

}  // namespace cellcal::calib
