#pragma once
// Worker tasks of a check (calib/check).

#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "daemon/result/outcome.h"
#include "daemon/result/qualification.h"
#include "daemon/tasks/tasks.h"

namespace cellcal::daemon {

/// Planning, touches one by one, and results: touches.csv and check.json, no calibration. A touch without
/// contact is a result, and the next one follows.
Tasks check_tasks(std::shared_ptr<const TaskInputs> inputs);

// Worker tasks of a session that locates spheres: their centres as lines for the cell file.

/// `made`: all touches of the session.
FoundSpheres found_spheres(const calib::Cell& cell, const std::vector<calib::Touch>& made,
                           const calib::PlanOptions& options);

/// `tasks`: planning, choice and path of the locating touches.
Tasks find_tasks(Tasks tasks, std::shared_ptr<const TaskInputs> inputs);

// Worker tasks of a dry run: the plan of a calibration with the same options, without a result.

Tasks dry_run_tasks(std::shared_ptr<const TaskInputs> inputs);

// Worker tasks of a qualification (daemon/result/qualification.h).

/// Planning and results: touches.csv and qualification.json, no calibration.
Tasks qualification_tasks(std::shared_ptr<const TaskInputs> inputs);

// Worker tasks of an update: the touches of a check, further ones depending on their result, and a
// calibration based on the last one.

/// `inputs->compared`: the calibration that it is based on. Throws calib::IdentifyError without one.
Tasks update_tasks(std::shared_ptr<const TaskInputs> inputs);

}  // namespace cellcal::daemon
