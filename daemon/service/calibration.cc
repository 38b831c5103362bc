#include <cmath>
#include <set>

#include "calib/identify/identify_once.h"
#include "calib/model/error.h"
#include "calib/model/kinematics.h"
#include "calib/plan/cell_check.h"
#include "calib/plan/finder.h"
#include "calib/plan/forecast.h"
#include "daemon/service/kind.h"
#include "daemon/tasks/active_calibration.h"
#include "daemon/tasks/planned_round.h"

namespace cellcal::daemon {

namespace {

/// Minimum to determine one sphere with its offset.
constexpr std::size_t kFewestForProvisional = 6;

/// The cell reduced to the targets touched so far.
calib::Cell part_of(const calib::Cell& cell, const std::vector<calib::Touch>& touches) {
  std::set<std::string> touched;
  for (const calib::Touch& touch : touches) touched.insert(touch.target);
  calib::Cell part = cell;
  std::erase_if(part.targets, [&](const calib::Target& t) { return !touched.contains(t.id); });
  std::erase_if(part.lengths, [&](const calib::CertifiedLength& length) {
    return !touched.contains(length.from) || !touched.contains(length.to);
  });
  return part;
}

std::optional<double> nominal_residual(const calib::Cell& cell, const calib::Touch& touch) {
  const calib::Target& target = cell.targets.at(cell.target_index(touch.target));
  if (!target.has_centre || target.kind != calib::TargetKind::kSphere) return std::nullopt;
  const calib::ArmModel arm(cell.robot, cell.tool);
  const auto carrier_rad = calib::carrier_rad(touch, target);
  const double distance =
      (arm.nominal_tcp(touch.joint_rad, 0, carrier_rad).translation() - target.centre_m).norm();
  return std::abs(distance - target.diameter_m / 2.0 - cell.tool.tip_radius_m);
}

std::optional<double> newest_residual(const calib::Cell& cell,
                                      const std::vector<calib::Touch>& touches) {
  if (touches.empty()) return std::nullopt;
  if (touches.size() < kFewestForProvisional) return nominal_residual(cell, touches.back());
  try {
    // Prediction from the other touches: a fit that includes the newest one is biased towards it.
    std::vector<calib::Touch> held_out = touches;
    held_out.back().set = calib::TouchSet::kCheck;
    const calib::Calibration provisional =
        calib::identify_single_pass(part_of(cell, touches), held_out);
    for (const calib::TouchResidual& residual : provisional.residuals) {
      if (residual.touch + 1 == touches.size()) return std::abs(residual.after_m);
    }
  } catch (const calib::IdentifyError&) {
    // Too few touches; the nominal residual is used.
    return nominal_residual(cell, touches.back());
  }
  return std::nullopt;
}

class CalibrationKind : public Kind {
 public:
  Parameters parameters() const override {
    return {.touches = true, .goal = true, .find = true, .seed = true};
  }

  std::optional<Compared> compared(Journal& journal, const Job& job) const override {
    return last_calibration(journal, job.inputs.cell_name, job.session, job.options.accept_change);
  }

  bool chooses(const Job& job) const override {
    return job.options.goal.u95_m > 0.0 || job.options.find || must_find(job.cell);
  }

  Tasks tasks(const SharedInputs& inputs) const override {
    const auto planned = std::make_shared<std::optional<calib::Plan>>();
    Tasks tasks = touching_tasks(inputs, planned);
    const auto forecast = std::make_shared<calib::ContactForecast>(inputs->cell);
    tasks.assess = [inputs, planned, forecast](const std::vector<calib::Touch>& touches) {
      Tasks::Assessed assessed{newest_residual(inputs->cell, touches)};
      if (inputs->options.one_by_one || !*planned) return assessed;
      forecast->learn(touches);
      assessed.expected = std::make_shared<const std::vector<calib::ExpectedContact>>(
          forecast->of(**planned, touches.size()));
      return assessed;
    };
    tasks.identify = [inputs](const std::vector<calib::Touch>& touches) {
      return SessionResult{estimate(inputs->cell, inputs->files, touches, inputs->compared)};
    };
    tasks.report = [inputs, planned](const SessionResult& result,
                                     const std::vector<calib::Touch>& touches) {
      write_results(*inputs, *result.calibration(), touches, *planned);
    };
    return tasks;
  }
};

}  // namespace

const Kind& calibration_kind() {
  static const CalibrationKind kind;
  return kind;
}

}  // namespace cellcal::daemon
