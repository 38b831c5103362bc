#include "daemon/tasks/find_tasks.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "calib/files/files.h"
#include "calib/model/units.h"
#include "calib/plan/finder.h"
#include "daemon/files/atomic_file.h"
#include "daemon/result/outcome.h"

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

std::string found_to_json(const FoundSpheres& found) {
  nlohmann::json spheres = nlohmann::json::array(), lines = nlohmann::json::array();
  for (const FoundSphere& one : found.spheres) {
    spheres.push_back(
        {{"target", one.target},
         {"centre_mm",
          {calib::kMmPerM * one.centre_m.x(), calib::kMmPerM * one.centre_m.y(),
           calib::kMmPerM * one.centre_m.z()}},
         {"u_mm", calib::kMmPerM * one.u_m},
         {"touches", one.touches},
         {"moved_mm", one.moved_m ? nlohmann::json(calib::kMmPerM * *one.moved_m) : nullptr}});
    lines.push_back(words(one));
  }
  const nlohmann::json all{{"format", "cellcal.found/1"}, {"spheres", spheres}, {"words", lines}};
  return all.dump(2) + "\n";
}

Tasks find_tasks(Tasks tasks, std::shared_ptr<const TaskInputs> inputs) {
  tasks.assess = [](const std::vector<calib::Touch>&) { return Tasks::Assessed{}; };
  tasks.identify = [inputs](const std::vector<calib::Touch>& touches) {
    return SessionResult{found_spheres(inputs->cell, touches, inputs->options.plan)};
  };
  tasks.report = [inputs](const SessionResult& result, const std::vector<calib::Touch>& touches) {
    const auto& found = std::get<FoundSpheres>(result.of);
    std::filesystem::create_directories(inputs->results_dir);
    write_atomically(inputs->results_dir / "touches.csv",
                     calib::format_touches(touches, inputs->cell.robot));
    write_atomically(inputs->results_dir / "found.json", found_to_json(found));
    for (const FoundSphere& one : found.spheres) inputs->note("found " + words(one));
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
