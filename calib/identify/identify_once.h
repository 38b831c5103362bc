#pragma once
// The calibration of one set of touches, taking cell file and touches at their word: estimate,
// figures of uncertainty, what does not agree, verdict. Which mistake explains a result that is
// withheld is asked elsewhere (calib/identify); it identifies again and again, each time as stated.

#include <string>
#include <variant>
#include <vector>

#include "calib/estimate/options.h"
#include "calib/model/error.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Without looking for causes. Throws IdentifyError where there is nothing to identify from, and
/// where the touches lead to no calibration.
Calibration identify_single_pass(const Cell& cell, const std::vector<Touch>& touches,
                                 const IdentifyOptions& options = {});

/// The same, for who goes on where there is none: by its reason.
std::variant<Calibration, IdentifyError> identified_or_why_not(const Cell& cell,
                                                               const std::vector<Touch>& touches,
                                                               const IdentifyOptions& options = {});

/// The nominal arm, withheld for the reason `why`. Throws IdentifyError where there is nothing to
/// identify from.
Calibration not_identified(const Cell& cell, const std::vector<Touch>& touches,
                           const IdentifyOptions& options, const std::string& why);

/// Throws IdentifyError where there are no fit touches, or an angle is not a number.
void require_sound(const Cell& cell, const std::vector<Touch>& touches);

}  // namespace cellcal::calib
