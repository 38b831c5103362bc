#pragma once
// From what a session recorded to its result: the same bits whenever it is done again by the same
// version.

#include <optional>
#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "calib/result/calibration.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon {

/// Identifies, judges the result against the earlier one, and states what it rests on. Throws
/// calib::IdentifyError, calib::FileError (an earlier one that cannot be read).
calib::Calibration estimate(const calib::Cell& cell, const SessionInputs& inputs,
                            const std::vector<calib::Touch>& touches,
                            const std::optional<Compared>& compared);

/// The same of an update: out of the calibration that it stands on. `not_found`: targets of which a touch met
/// nothing.
calib::Calibration estimate_update(const SessionInputs& inputs,
                                   const std::vector<calib::Touch>& touches, const Compared& last,
                                   double months, const std::vector<std::string>& not_found);

}  // namespace cellcal::daemon
