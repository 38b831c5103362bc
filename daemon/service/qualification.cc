#include "daemon/result/qualification.h"

#include <fmt/format.h>

#include "calib/identify/identify_once.h"
#include "calib/model/error.h"
#include "calib/model/parameter_key.h"
#include "calib/model/units.h"
#include "calib/plan/check_plan.h"
#include "daemon/result/contact_delay.h"
#include "daemon/service/kind.h"

namespace cellcal::daemon {

namespace {

/// The delay is estimated from two speeds. (The slowest search also has to be fast enough to fit one arming.)
void check_qualification_speeds(const TouchPolicy& touch) {
  if (touch.fast_m_s - touch.slow_m_s >= kLeastSpeedDifferenceMS) return;
  throw RequestError(fmt::format(
      "fast_search_mm_s = {:g} and slow_search_mm_s = {:g}: a qualification needs {:g} mm/s between them. Set "
      "them under [motion]",
      calib::kMmPerM * touch.fast_m_s, calib::kMmPerM * touch.slow_m_s,
      calib::kMmPerM * kLeastSpeedDifferenceMS));
}

void examine_target(const calib::Cell& cell, const std::string& target) {
  try {
    calib::qualification_target(cell, target);
  } catch (const calib::PlanError& wrong) {
    throw RequestError(wrong.what());
  }
}

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
      calib::identify_single_pass(one_sphere(inputs.cell, touches.front().target), touches);
  const calib::ParameterResult* rho =
      find(calibration, calib::tool_parameter(calib::ParameterKind::kEffectiveRadius, 0));
  if (rho == nullptr) return std::nullopt;
  return Figure{rho->correction, rho->sigma};
} catch (const calib::IdentifyError&) {
  return std::nullopt;
}

class QualificationKind : public Kind {
 public:
  Parameters parameters() const override {
    return {.seed = true,
            .target = true,
            .refusal = "a qualification has its own touches: leave goal_mm, find and touches out"};
  }

  bool chooses(const Job&) const override { return false; }

  void examine(const Job& job) const override {
    examine_target(job.cell, job.options.target);
    check_qualification_speeds(job.options.touch);
  }

  void adapt(State& first, const Job&) const override { first.policy.confirm_every = 1; }

  /// Planning and results: touches.csv and qualification.json, no calibration.
  Tasks tasks(const SharedInputs& inputs) const override {
    const auto plan = std::make_shared<calib::Plan>();
    Tasks tasks;
    tasks.plan = [inputs, plan] {
      *plan = plan_of(*inputs);
      return Tasks::Planned{*plan, plan_hash(*plan), {}};
    };
    tasks.identify = [inputs, plan](const std::vector<calib::Touch>& touches) {
      const calib::Cell& cell = inputs->cell;
      const StatedContact stated{cell.touch_sigma_m, cell.latch_delay_s, cell.latch_delay_sigma_s,
                                 cell.radius_offset_sigma_m};
      return SessionResult{qualify(
          *plan, inputs->readings(), inputs->options.touch.fast_m_s, inputs->options.touch.slow_m_s,
          stated, radius_offset(*inputs, touches), inputs->options.touch.confirm_every <= 1)};
    };
    tasks.report = [inputs](const SessionResult& result, const std::vector<calib::Touch>& touches) {
      write_document(*inputs, result, touches, "qualification.json");
    };
    return with_route(std::move(tasks), inputs);
  }
};

}  // namespace

const Kind& qualification_kind() {
  static const QualificationKind kind;
  return kind;
}

}  // namespace cellcal::daemon
