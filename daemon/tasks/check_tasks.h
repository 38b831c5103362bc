#pragma once
// Worker tasks of a check (calib/check).

#include "daemon/tasks/tasks.h"

namespace cellcal::daemon {

/// Planning, touches one by one, and results: touches.csv and check.json, no calibration. A touch without
/// contact is a result, and the next one follows.
Tasks check_tasks(std::shared_ptr<const TaskInputs> inputs);

}  // namespace cellcal::daemon
