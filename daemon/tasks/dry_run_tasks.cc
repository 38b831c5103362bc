#include "daemon/tasks/dry_run_tasks.h"

#include "daemon/result/outcome_words.h"

namespace cellcal::daemon {

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
