#include "daemon/tasks/qualification_tasks.h"

#include <nlohmann/json.hpp>
#include <vector>

#include "calib/files/files.h"
#include "calib/identify/identify_once.h"
#include "calib/model/parameter_key.h"
#include "calib/model/units.h"
#include "calib/plan/check_plan.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

using calib::kMmPerM;
using calib::kMsPerS;

calib::Plan plan_of(const TaskInputs& inputs) {
  std::vector<double> speeds_m_s;
  for (const double share : kQualificationShares)
    speeds_m_s.push_back(share * inputs.options.touch.fast_m_s);
  return calib::make_qualification_plan(inputs.cell, inputs.options.plan, inputs.options.target,
                                        kQualificationPlaces, speeds_m_s);
}

/// The cell reduced to the touched sphere.
calib::Cell one_sphere(const calib::Cell& cell, const std::string& target) {
  calib::Cell part = cell;
  std::erase_if(part.targets, [&](const calib::Target& t) { return t.id != target; });
  part.lengths.clear();
  return part;
}

/// None: not determined by the few touches of one sphere.
std::optional<Figure> radius_offset(const TaskInputs& inputs,
                                    const std::vector<calib::Touch>& touches) try {
  if (touches.empty()) return std::nullopt;
  const calib::Calibration calibration =
      calib::identify_as_stated(one_sphere(inputs.cell, touches.front().target), touches);
  const calib::ParameterResult* rho =
      find(calibration, calib::tool_parameter(calib::ParameterKind::kEffectiveRadius, 0));
  if (rho == nullptr) return std::nullopt;
  return Figure{rho->correction, rho->sigma};
} catch (const calib::IdentifyError&) {
  return std::nullopt;
}

json figure(const std::optional<Figure>& figure, double factor) {
  if (!figure) return nullptr;
  return {{"value", factor * figure->value}, {"sigma", factor * figure->sigma}};
}

}  // namespace

std::string qualification_to_json(const Qualification& q) {
  json value{{"format", "cellcal.qualification/1"},
             {"target", q.target},
             {"touches", q.touches},
             {"places", q.places},
             {"touch_noise_mm", figure(q.noise_m, kMmPerM)},
             {"touch_noise_dof", q.noise_dof},
             {"latch_delay_ms", nullptr},
             {"overtravel", json::array()},
             {"overtravel_limit_mm", kMmPerM * kOvertravelLimitM},
             {"reaction_worst_ms", kMsPerS * q.reaction_worst_s},
             {"bounces_worst", q.bounces_worst},
             {"radius_offset_mm", figure(q.radius_offset_m, kMmPerM)},
             {"stated",
              {{"touch_sigma_mm", kMmPerM * q.stated.touch_sigma_m},
               {"latch_delay_ms", kMsPerS * q.stated.delay_s},
               {"latch_delay_sigma_ms", kMsPerS * q.stated.delay_sigma_s},
               {"radius_offset_sigma_mm", kMmPerM * q.stated.radius_offset_sigma_m}}},
             {"passed", q.passed()},
             {"findings", json::array()},
             {"words", in_words(q)}};
  if (q.delay)
    value["latch_delay_ms"] = {{"value", kMsPerS * q.delay->delay_s},
                               {"sigma", kMsPerS * q.delay->sigma_s}};
  for (const Overtravel& o : q.overtravel)
    value["overtravel"].push_back({{"speed_mm_s", kMmPerM * o.speed_m_s},
                                   {"searches", o.searches},
                                   {"median_mm", kMmPerM * o.median_m},
                                   {"worst_mm", kMmPerM * o.worst_m}});
  for (const QualificationFinding finding : q.findings)
    value["findings"].push_back(to_string(finding));
  return value.dump(2) + "\n";
}

Tasks qualification_tasks(std::shared_ptr<const TaskInputs> inputs) {
  const auto plan = std::make_shared<calib::Plan>();
  Tasks tasks;
  tasks.plan = [inputs, plan] {
    *plan = plan_of(*inputs);
    return Tasks::Planned{*plan, plan_hash(*plan), {}};
  };
  tasks.assess = [](const std::vector<calib::Touch>&) { return Tasks::Assessed{}; };
  tasks.identify = [inputs, plan](const std::vector<calib::Touch>& touches) {
    const calib::Cell& cell = inputs->cell;
    const StatedContact stated{cell.touch_sigma_m, cell.latch_delay_s, cell.latch_delay_sigma_s,
                               cell.radius_offset_sigma_m};
    return SessionResult{qualify(
        *plan, inputs->readings(), inputs->options.touch.fast_m_s, inputs->options.touch.slow_m_s,
        stated, radius_offset(*inputs, touches), inputs->options.touch.confirm_every <= 1)};
  };
  tasks.report = [inputs](const SessionResult& result, const std::vector<calib::Touch>& touches) {
    std::filesystem::create_directories(inputs->results_dir);
    write_atomically(inputs->results_dir / "touches.csv",
                     calib::format_touches(touches, inputs->cell.robot));
    write_atomically(inputs->results_dir / "qualification.json",
                     qualification_to_json(std::get<Qualification>(result.of)));
  };
  return tasks;
}

}  // namespace cellcal::daemon
