#pragma once
// Computes a session's result from its records: identical to the bit with the same version.

#include <optional>
#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "calib/result/calibration.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon {

/// Identifies, judges the result against the earlier one, and records its basis. Throws calib::IdentifyError,
/// calib::FileError (an unreadable earlier one).
calib::Calibration estimate(const calib::Cell& cell, const SessionInputs& inputs,
                            const std::vector<calib::Touch>& touches,
                            const std::optional<Compared>& compared);

/// The same for an update, based on the calibration `last`. `not_found`: targets with a touch without
/// contact.
calib::Calibration estimate_update(const SessionInputs& inputs,
                                   const std::vector<calib::Touch>& touches, const Compared& last,
                                   double months, const std::vector<std::string>& not_found);

}  // namespace cellcal::daemon
