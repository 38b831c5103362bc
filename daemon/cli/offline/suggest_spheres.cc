#include "calib/plan/suggest_spheres.h"

#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calib/files/files.h"
#include "calib/model/units.h"
#include "daemon/cli/offline/exit_status.h"
#include "daemon/cli/offline/offline.h"
#include "daemon/report/drawing/plan_picture.h"

namespace cellcal::daemon {

namespace {

using calib::kMmPerM;

/// Of the cell as its file has it; none: it cannot be planned, which is said.
std::optional<calib::Plan> plan_of_today(const calib::Cell& cell,
                                         const calib::PlanOptions& options) try {
  return calib::make_plan(cell, options);
} catch (const calib::PlanError& error) {
  fmt::print(stderr, "warning: no plan with today's spheres to compare with: {}\n", error.what());
  return std::nullopt;
}

std::string accuracy_words(const calib::Plan& plan) {
  return fmt::format("predicted mean error {:.3f} mm, u95 {:.3f} mm",
                     plan.predicted_mean_m * kMmPerM, plan.predicted_u95_m * kMmPerM);
}

std::vector<calib::Target> spheres_of(const calib::Cell& cell) {
  std::vector<calib::Target> spheres = cell.targets;
  std::erase_if(spheres, [](const auto& one) { return one.kind != calib::TargetKind::kSphere; });
  return spheres;
}

/// As a cell file has them.
std::string file_lines(const calib::Cell& cell) {
  std::string lines;
  for (const calib::Target& target : spheres_of(cell))
    lines += fmt::format(
        "\n[[target]]\nid = \"{}\"\nkind = \"sphere\"\ndiameter_mm = {:g}\n"
        "centre_mm = [{:.0f}, {:.0f}, {:.0f}]\ncentre_sigma_mm = {:g}\n",
        target.id, target.diameter_m * kMmPerM, target.centre_m.x() * kMmPerM,
        target.centre_m.y() * kMmPerM, target.centre_m.z() * kMmPerM,
        target.centre_sigma_m * kMmPerM);
  return lines;
}

nlohmann::json accuracy_json(const calib::Plan& plan) {
  return {{"predicted_m3_mm", plan.predicted_mean_m * kMmPerM},
          {"predicted_u95_mm", plan.predicted_u95_m * kMmPerM}};
}

std::string json(const calib::SuggestedSpheres& suggested,
                 const std::optional<calib::Plan>& today) {
  nlohmann::json value = accuracy_json(suggested.plan);
  value["today"] = today ? accuracy_json(*today) : nlohmann::json(nullptr);
  for (const calib::Target& target : spheres_of(suggested.cell))
    value["spheres"].push_back({{"id", target.id},
                                {"diameter_mm", target.diameter_m * kMmPerM},
                                {"centre_mm",
                                 {target.centre_m.x() * kMmPerM, target.centre_m.y() * kMmPerM,
                                  target.centre_m.z() * kMmPerM}}});
  return value.dump(1) + "\n";
}

}  // namespace

int suggest_spheres(const PlanCommand& command, const calib::Cell& cell,
                    const calib::PlanOptions& options) {
  const calib::SuggestedSpheres suggested =
      calib::suggest_spheres(cell, options, command.suggest_spheres);
  const std::optional<calib::Plan> today = plan_of_today(cell, options);
  if (!command.picture.empty()) put(plan_svg(suggested.cell, suggested.plan), command.picture);
  if (command.json) {
    put(json(suggested, today), command.output);
    return kSuccess;
  }
  const bool gains = !today || suggested.plan.predicted_mean_m < today->predicted_mean_m;
  const std::string words =
      fmt::format("# {} with {} touches, region {}: {} spheres at these places\n",
                  accuracy_words(suggested.plan), command.touches, command.region,
                  spheres_of(suggested.cell).size()) +
      (today ? fmt::format("# {} today{}\n", accuracy_words(*today),
                           gains ? "" : ": today's places are as good, leave the spheres there")
             : "") +
      fmt::format(
          "# Put each sphere within {:.0f} mm of its place, base frame. Then have the distances certified and run "
          "'cellcal find'\n",
          suggested.cell.targets.front().centre_sigma_m * kMmPerM);
  put(words + file_lines(suggested.cell), command.output);
  if (!command.output.empty()) put(words, {});
  return kSuccess;
}

}  // namespace cellcal::daemon
