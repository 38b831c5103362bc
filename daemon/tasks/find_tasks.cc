#include "daemon/tasks/find_tasks.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "calib/files/files.h"
#include "calib/model/units.h"
#include "calib/plan/search/finder.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

/// k = 2; what the finder means by found (finder.h).
constexpr double kExpandedMm = 2.0 * calib::kMmPerM * calib::kFoundSigmaM;

/// As the cell file has it.
std::string line_of(const FoundSphere& sphere) {
  return fmt::format("centre_mm = [{:.2f}, {:.2f}, {:.2f}]", calib::kMmPerM * sphere.centre_m.x(),
                     calib::kMmPerM * sphere.centre_m.y(), calib::kMmPerM * sphere.centre_m.z());
}

std::string words_of(const FoundSphere& sphere) {
  std::string words = fmt::format("{}: {}  # +- {:g} mm (k=2), {} touches", sphere.target,
                                  line_of(sphere), kExpandedMm, sphere.touches);
  if (sphere.moved_m)
    words += fmt::format(", {:.1f} mm from the cell file's", calib::kMmPerM * *sphere.moved_m);
  return words;
}

}  // namespace

std::vector<FoundSphere> found_spheres(const calib::Cell& cell,
                                       const std::vector<calib::Touch>& made,
                                       const calib::PlanOptions& options) {
  const calib::Finder finder(cell, options, true, made);
  std::vector<FoundSphere> all;
  for (std::size_t t = 0; t < cell.targets.size(); ++t) {
    const calib::Target& stated = cell.targets[t];
    if (stated.kind != calib::TargetKind::kSphere) continue;
    FoundSphere& sphere = all.emplace_back();
    sphere.target = stated.id;
    sphere.centre_m = finder.located().targets[t].centre_m;
    sphere.touches = static_cast<int>(std::ranges::count(made, stated.id, &calib::Touch::target));
    if (stated.has_centre) sphere.moved_m = (sphere.centre_m - stated.centre_m).norm();
  }
  return all;
}

std::string found_to_json(const std::vector<FoundSphere>& found) {
  nlohmann::json spheres = nlohmann::json::array(), words = nlohmann::json::array();
  for (const FoundSphere& one : found) {
    spheres.push_back(
        {{"target", one.target},
         {"centre_mm",
          {calib::kMmPerM * one.centre_m.x(), calib::kMmPerM * one.centre_m.y(),
           calib::kMmPerM * one.centre_m.z()}},
         {"u_mm", kExpandedMm},
         {"touches", one.touches},
         {"moved_mm", one.moved_m ? nlohmann::json(calib::kMmPerM * *one.moved_m) : nullptr}});
    words.push_back(words_of(one));
  }
  const nlohmann::json all{{"format", "cellcal.found/1"}, {"spheres", spheres}, {"words", words}};
  return all.dump(2) + "\n";
}

Tasks find_tasks(Tasks tasks, std::shared_ptr<const TaskInputs> inputs) {
  tasks.assess = [](const std::vector<calib::Touch>&) { return Tasks::Assessed{}; };
  tasks.identify = [](const std::vector<calib::Touch>&) { return calib::Calibration{}; };
  tasks.report = [inputs](const calib::Calibration&, const std::vector<calib::Touch>& touches) {
    const auto found = found_spheres(inputs->cell, touches, inputs->options.plan);
    std::filesystem::create_directories(inputs->results_dir);
    write_atomically(inputs->results_dir / "touches.csv",
                     calib::format_touches(touches, inputs->cell.robot));
    write_atomically(inputs->results_dir / "found.json", found_to_json(found));
    for (const FoundSphere& one : found) inputs->note("found " + words_of(one));
  };
  return tasks;
}

}  // namespace cellcal::daemon
