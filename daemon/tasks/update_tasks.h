#pragma once
// Worker tasks of an update: the touches of a check, further ones depending on their result, and a
// calibration based on the last one.

#include "daemon/tasks/tasks.h"

namespace cellcal::daemon {

/// `inputs->compared`: the calibration that it is based on. Throws calib::IdentifyError without one.
Tasks update_tasks(std::shared_ptr<const TaskInputs> inputs);

}  // namespace cellcal::daemon
