#pragma once
// Worker tasks of a qualification (daemon/qualification/qualification.h).

#include "daemon/qualification/qualification.h"
#include "daemon/tasks/tasks.h"

namespace cellcal::daemon {

/// Planning and results: touches.csv and qualification.json, no calibration.
Tasks qualification_tasks(std::shared_ptr<const TaskInputs> inputs);

/// One document, millimetres and milliseconds, with kind and text of each finding.
std::string qualification_to_json(const Qualification& qualification);

}  // namespace cellcal::daemon
