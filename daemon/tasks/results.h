#pragma once
// Files of a calibration session (touches, calibration, report), and the calibration in the journal.

#include <optional>
#include <vector>

#include "daemon/tasks/tasks.h"

namespace cellcal::daemon {

/// `plan`: the executed plan, for the report. Throws where they cannot be written.
void write_results(const TaskInputs& inputs, const calib::Calibration& calibration,
                   const std::vector<calib::Touch>& touches,
                   const std::optional<calib::Plan>& plan);

}  // namespace cellcal::daemon
