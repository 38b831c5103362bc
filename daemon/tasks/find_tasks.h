#pragma once
// Worker tasks of a session that locates spheres: their centres as lines for the cell file.

#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "daemon/result/outcome.h"
#include "daemon/tasks/tasks.h"

namespace cellcal::daemon {

/// `made`: all touches of the session.
FoundSpheres found_spheres(const calib::Cell& cell, const std::vector<calib::Touch>& made,
                           const calib::PlanOptions& options);

/// `tasks`: planning, choice and path of the locating touches.
Tasks find_tasks(Tasks tasks, std::shared_ptr<const TaskInputs> inputs);

// Worker tasks of a dry run: the plan of a calibration with the same options, without a result.

Tasks dry_run_tasks(std::shared_ptr<const TaskInputs> inputs);

}  // namespace cellcal::daemon
