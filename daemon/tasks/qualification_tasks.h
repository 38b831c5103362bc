#pragma once
// Worker tasks of a qualification (daemon/qualification/qualification.h).

#include "daemon/qualification/qualification.h"
#include "daemon/tasks/tasks.h"

namespace cellcal::daemon {

/// Planning and results: touches.csv and qualification.json, no calibration.
Tasks qualification_tasks(std::shared_ptr<const TaskInputs> inputs);

}  // namespace cellcal::daemon
