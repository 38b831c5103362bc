#pragma once
// What the worker does for an update: a check's touches, further ones by what these leave open, and a calibration
// out of the last one.

#include "daemon/tasks/tasks.h"

namespace cellcal::daemon {

/// `inputs->compared` is the calibration that it stands on. Throws calib::IdentifyError where there is none.
Tasks update_tasks(std::shared_ptr<const TaskInputs> inputs);

}  // namespace cellcal::daemon
