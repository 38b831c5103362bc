#include "daemon/service/status_of.h"

#include <algorithm>
#include <chrono>

#include "calib/model/enum_table.h"
#include "calib/plan/cell_check.h"
#include "calib/plan/online.h"
#include "calib/result/finding.h"
#include "daemon/session/rules.h"

namespace cellcal::daemon {

namespace {

Waiting waiting_of(const State& state, drivers::TimePoint now) {
  const rules::Missing missing = rules::missing(state);
  const double left_s = std::chrono::duration<double>(*state.deadline - now).count();
  return {missing.robot, missing.contact, std::max(0.0, left_s), state.how_to_start};
}

double seconds_to(drivers::TimePoint then, const Job& job) {
  return std::max(0.0, std::chrono::duration<double>(then - job.backend->clock().now()).count());
}

/// Fields of touches chosen one by one.
void set_choice_progress(const State& state, const Job& job, Status& status) {
  if (job.options.goal.u95_m > 0.0) status.goal_m = job.options.goal.u95_m;
  status.finding = state.progress.finding;
  status.stage = state.stage;
  if (state.progress.u95_m > 0.0) {
    status.u95_m = state.progress.u95_m;
    status.mean_error_m = state.progress.mean_m;
  }
  status.why_ended = calib::why_ended(state.progress, job.options.goal);
}

}  // namespace

const char* to_string(ArmMotion motion) {
  using enum ArmMotion;
  static constexpr EnumNames<ArmMotion> kTable{
      {{kUnknown, "unknown"}, {kAtRest, "at rest"}, {kMoving, "moving"}}};
  return kTable[motion];
}

Status status_of(const State& state, const Job& job, std::size_t done) {
  Status status;
  status.session = job.session;
  status.kind = to_string(job.options.kind);
  status.phase = state.phase;
  status.done = std::max(state.done, done);
  const calib::Calibration* calibration = state.result ? state.result->calibration() : nullptr;
  status.residual_m = calibration != nullptr ? calibration->after.mean_m : state.residual_m;
  status.robot_words = state.links.robot_words;
  status.contact_words = state.links.contact_words;
  status.failure = state.failure;
  status.warnings = job.warnings;
  status.interruptions = state.interruptions;
  if (state.busy_until && kAwaitingPhases.has(state.phase))
    status.busy_left_s = seconds_to(*state.busy_until, job);
  if (state.phase == Phase::kConnecting && state.deadline)
    status.waiting = waiting_of(state, job.backend->clock().now());
  if (state.plan) {
    status.total = std::max(state.total(), status.done);
    if (state.current_index() < state.plan->touches.size()) status.target = state.planned().target;
    if (const auto fault = calib::fault_of(job.cell, *state.plan))
      status.warnings.push_back(words(*fault));
  }
  if (job.options.one_by_one) set_choice_progress(state, job, status);
  const bool given_up = state.phase == Phase::kFailed || state.phase == Phase::kAborted;
  if (state.result && !given_up) status.outcome = outcome_of(*state.result);
  if (calibration != nullptr) status.reasons = calib::words(calibration->verdict.findings);
  return status;
}

}  // namespace cellcal::daemon
