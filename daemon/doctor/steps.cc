#include "daemon/doctor/steps.h"

#include <algorithm>

#include "calib/model/enum_table.h"

namespace cellcal::daemon {

namespace {

const std::optional<Looked>& looked_at(const Evidence& evidence, SetUpStep step) {
  switch (step) {
    case SetUpStep::kCell:
      return evidence.cell_file;
    case SetUpStep::kRobot:
      return evidence.robot_file;
    case SetUpStep::kSpheres:
      return evidence.targets;
    case SetUpStep::kDoctor:
      return evidence.doctor;
    case SetUpStep::kQualify:
      return evidence.qualification;
    case SetUpStep::kDryRun:
      return evidence.dry_run;
    case SetUpStep::kFirst:
      return evidence.first;
    case SetUpStep::kCalibration:
      break;
  }
  return evidence.calibration;
}

}  // namespace

const char* to_string(SetUpStep step) {
  using enum SetUpStep;
  static constexpr EnumNames<SetUpStep> kTable{{{kCell, "cell"},
                                                {kRobot, "robot"},
                                                {kSpheres, "spheres"},
                                                {kDoctor, "doctor"},
                                                {kQualify, "qualify"},
                                                {kDryRun, "dry-run"},
                                                {kFirst, "first"},
                                                {kCalibration, "calibration"}}};
  return kTable[step];
}

const char* to_string(StepState state) {
  using enum StepState;
  static constexpr EnumNames<StepState> kTable{
      {{kTodo, "todo"}, {kDone, "done"}, {kWrong, "wrong"}}};
  return kTable[state];
}

std::vector<StepSeen> steps_of(const Evidence& evidence) {
  std::vector<StepSeen> steps;
  for (const SetUpStep step : kAllSteps) {
    StepSeen& seen = steps.emplace_back();
    seen.step = step;
    const std::optional<Looked>& looked = looked_at(evidence, step);
    if (!looked) continue;
    seen.state = looked->good ? StepState::kDone : StepState::kWrong;
    seen.words = looked->words;
    seen.session = looked->session;
  }
  return steps;
}

std::optional<SetUpStep> next_of(const std::vector<StepSeen>& steps) {
  const auto open = std::find_if(steps.begin(), steps.end(),
                                 [](const StepSeen& one) { return one.state != StepState::kDone; });
  return open == steps.end() ? std::nullopt : std::optional(open->step);
}

}  // namespace cellcal::daemon
