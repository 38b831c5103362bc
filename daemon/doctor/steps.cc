#include "daemon/doctor/steps.h"

#include <algorithm>

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
  switch (step) {
    case SetUpStep::kCell:
      return "cell";
    case SetUpStep::kRobot:
      return "robot";
    case SetUpStep::kSpheres:
      return "spheres";
    case SetUpStep::kDoctor:
      return "doctor";
    case SetUpStep::kQualify:
      return "qualify";
    case SetUpStep::kDryRun:
      return "dry-run";
    case SetUpStep::kFirst:
      return "first";
    case SetUpStep::kCalibration:
      return "calibration";
  }
  return "unknown";
}

const char* to_string(StepState state) {
  switch (state) {
    case StepState::kTodo:
      return "todo";
    case StepState::kDone:
      return "done";
    case StepState::kWrong:
      return "wrong";
  }
  return "unknown";
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
