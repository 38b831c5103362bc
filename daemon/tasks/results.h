#pragma once
// The files of a session: touches, result, report; and the calibration in the journal.

#include <optional>
#include <vector>

#include "daemon/tasks/tasks.h"

namespace cellcal::daemon {

/// `plan`: the executed plan, for the report. Throws where they cannot be written.
void write_results(const TaskInputs& inputs, const calib::Calibration& calibration,
                   const std::vector<calib::Touch>& touches,
                   const std::optional<calib::Plan>& plan);
/// touches.csv and, as `name`, the document of a result that is no calibration. Throws where they cannot be written.
void write_document(const TaskInputs& inputs, const SessionResult& result,
                    const std::vector<calib::Touch>& touches, const char* name);

}  // namespace cellcal::daemon
