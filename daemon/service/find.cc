#include <algorithm>

#include "calib/plan/finder.h"
#include "calib/plan/track.h"
#include "daemon/result/outcome.h"
#include "daemon/service/kind.h"

namespace cellcal::daemon {

namespace {

FoundSpheres found_spheres(const calib::Cell& cell, const std::vector<calib::Touch>& made,
                           const calib::PlanOptions& options) {
  const calib::Finder finder(cell, options, true, made);
  const calib::Cell located = finder.located();
  FoundSpheres all;
  for (std::size_t t = 0; t < cell.targets.size(); ++t) {
    const calib::Target& stated = cell.targets[t];
    if (stated.kind != calib::TargetKind::kSphere) continue;
    FoundSphere& sphere = all.spheres.emplace_back();
    sphere.target = stated.id;
    sphere.centre_m = located.targets[t].centre_m;
    if (stated.carried_by > 0) {
      sphere.on = cell.robot.positioner.at(static_cast<std::size_t>(stated.carried_by) - 1).name;
      sphere.taught_rad = located.targets[t].taught_rad;
    }
    sphere.u_m = 2.0 * finder.centre_sigma_m(t);
    sphere.touches = static_cast<int>(std::ranges::count(made, stated.id, &calib::Touch::target));
    if (stated.has_centre) sphere.moved_m = (sphere.centre_m - stated.centre_m).norm();
  }
  return all;
}

class FindKind : public Kind {
 public:
  Parameters parameters() const override {
    return {.find = true,
            .seed = true,
            .refusal = "finding ends when all spheres are found: leave goal_mm and touches out"};
  }

  void begin(Journal& journal, const RunRequest& request, Job& job) const override {
    Kind::begin(journal, request, job);
    job.options.find = true;
  }

  /// Planning, choice and path of the locating touches; their centres as lines for the cell file.
  Tasks tasks(const SharedInputs& inputs) const override {
    Tasks tasks = touching_tasks(inputs, std::make_shared<std::optional<calib::Plan>>(), true);
    tasks.identify = [inputs](const std::vector<calib::Touch>& touches) {
      return SessionResult{found_spheres(inputs->cell, touches, inputs->options.plan)};
    };
    tasks.report = [inputs](const SessionResult& result, const std::vector<calib::Touch>& touches) {
      write_document(*inputs, result, touches, "found.json");
      for (const FoundSphere& one : std::get<FoundSpheres>(result.of).spheres)
        inputs->note("found " + calib::words(phrase(one)));
    };
    return tasks;
  }
};

}  // namespace

const Kind& find_kind() {
  static const FindKind kind;
  return kind;
}

}  // namespace cellcal::daemon
