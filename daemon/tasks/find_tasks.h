#pragma once
// What comes of a session that only finds the spheres: their centres, as lines for the cell file.

#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "daemon/tasks/tasks.h"

namespace cellcal::daemon {

struct FoundSphere {
  std::string target;
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();  ///< base frame of the nominal arm
  int touches = 0;
  std::optional<double> moved_m;  ///< from the cell file's centre; none there
};

/// `made`: all touches of the session.
std::vector<FoundSphere> found_spheres(const calib::Cell& cell,
                                       const std::vector<calib::Touch>& made,
                                       const calib::PlanOptions& options);
/// cellcal.found/1, millimetres.
std::string found_to_json(const std::vector<FoundSphere>& found);

/// `tasks`: planning, choice and route of touches that find.
Tasks find_tasks(Tasks tasks, std::shared_ptr<const TaskInputs> inputs);

}  // namespace cellcal::daemon
