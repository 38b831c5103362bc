#pragma once
// What comes of a session that only finds the spheres: their centres, as lines for the cell file.

#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "daemon/result/session_result.h"
#include "daemon/tasks/tasks.h"

namespace cellcal::daemon {

/// `made`: all touches of the session.
FoundSpheres found_spheres(const calib::Cell& cell, const std::vector<calib::Touch>& made,
                           const calib::PlanOptions& options);

/// `tasks`: planning, choice and route of touches that find.
Tasks find_tasks(Tasks tasks, std::shared_ptr<const TaskInputs> inputs);

// What the worker does for a dry run: the plan that a calibration of the same options has, and no result.

Tasks dry_run_tasks(std::shared_ptr<const TaskInputs> inputs);

}  // namespace cellcal::daemon
