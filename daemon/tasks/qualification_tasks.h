#pragma once
// What the worker does for a qualification (daemon/qualification/qualification.h) instead of a calibration.

#include "daemon/qualification/qualification.h"
#include "daemon/tasks/tasks.h"

namespace cellcal::daemon {

/// Planning, and what comes of it: touches.csv and qualification.json, no calibration.
Tasks qualification_tasks(std::shared_ptr<const TaskInputs> inputs);

}  // namespace cellcal::daemon
