#include "daemon/tasks/find_tasks.h"

#include <algorithm>

#include "calib/plan/finder.h"
#include "daemon/result/outcome.h"
#include "daemon/tasks/tasks.h"

namespace cellcal::daemon {

FoundSpheres found_spheres(const calib::Cell& cell, const std::vector<calib::Touch>& made,
                           const calib::PlanOptions& options) {
  const calib::Finder finder(cell, options, true, made);
  FoundSpheres all;
  for (std::size_t t = 0; t < cell.targets.size(); ++t) {
    const calib::Target& stated = cell.targets[t];
    if (stated.kind != calib::TargetKind::kSphere) continue;
    FoundSphere& sphere = all.spheres.emplace_back();
    sphere.target = stated.id;
    sphere.centre_m = finder.located().targets[t].centre_m;
    sphere.u_m = 2.0 * calib::kFoundSigmaM;  // k = 2; criterion of the finder (finder.h)
    sphere.touches = static_cast<int>(std::ranges::count(made, stated.id, &calib::Touch::target));
    if (stated.has_centre) sphere.moved_m = (sphere.centre_m - stated.centre_m).norm();
  }
  return all;
}

Tasks find_tasks(Tasks tasks, std::shared_ptr<const TaskInputs> inputs) {
  tasks.assess = [](const std::vector<calib::Touch>&) { return Tasks::Assessed{}; };
  tasks.identify = [inputs](const std::vector<calib::Touch>& touches) {
    return SessionResult{found_spheres(inputs->cell, touches, inputs->options.plan)};
  };
  tasks.report = [inputs](const SessionResult& result, const std::vector<calib::Touch>& touches) {
    write_document(*inputs, result, touches, "found.json");
    for (const FoundSphere& one : std::get<FoundSpheres>(result.of).spheres)
      inputs->note("found " + words(one));
  };
  return tasks;
}

Tasks dry_run_tasks(std::shared_ptr<const TaskInputs> inputs) {
  const auto standoffs = std::make_shared<std::size_t>(0);
  Tasks tasks;
  tasks.plan = [inputs, standoffs] {
    Tasks::Planned planned = plan_beforehand(*inputs);
    *standoffs = planned.plan.touches.size();
    return planned;
  };
  tasks.assess = [](const std::vector<calib::Touch>&) { return Tasks::Assessed{}; };
  tasks.identify = [standoffs](const std::vector<calib::Touch>&) {
    return SessionResult{DryRun{*standoffs}};
  };
  tasks.report = [inputs](const SessionResult& result, const std::vector<calib::Touch>&) {
    inputs->note("dry run: " + words(outcome_of(result)).front());
  };
  return tasks;
}

}  // namespace cellcal::daemon
