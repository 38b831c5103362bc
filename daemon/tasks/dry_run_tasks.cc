#include "daemon/tasks/dry_run_tasks.h"

#include <fmt/format.h>

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
  tasks.identify = [](const std::vector<calib::Touch>&) { return calib::Calibration{}; };
  tasks.report = [inputs, standoffs](const calib::Calibration&, const std::vector<calib::Touch>&) {
    inputs->note(fmt::format("dry run: {} stand-offs reached, the tip met nothing", *standoffs));
  };
  return tasks;
}

}  // namespace cellcal::daemon
