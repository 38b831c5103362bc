#pragma once
// What the worker does for a dry run: the plan that a calibration of the same options has, and no result.

#include "daemon/tasks/tasks.h"

namespace cellcal::daemon {

Tasks dry_run_tasks(std::shared_ptr<const TaskInputs> inputs);

}  // namespace cellcal::daemon
