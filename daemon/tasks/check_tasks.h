#pragma once
// What the worker does for a check (calib/check) instead of a calibration.

#include "daemon/tasks/tasks.h"

namespace cellcal::daemon {

/// Planning, one touch after the other, and what comes of it: touches.csv and check.json, no calibration. A touch
/// that meets nothing is an answer, and the next one is made.
Tasks check_tasks(std::shared_ptr<const TaskInputs> inputs);

}  // namespace cellcal::daemon
