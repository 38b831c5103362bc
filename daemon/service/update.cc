#include "calib/identify/update.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "calib/check/tcp_check.h"
#include "calib/files/calibration_json.h"
#include "calib/model/error.h"
#include "calib/plan/check_plan.h"
#include "calib/plan/duration.h"
#include "calib/result/finding.h"
#include "daemon/files/atomic_file.h"
#include "daemon/service/kind.h"
#include "daemon/tasks/active_calibration.h"
#include "daemon/tasks/planned_round.h"

namespace cellcal::daemon {

namespace {

/// Newest published calibration of the cell file, as the base of an update.
SessionRecord calibration_to_update(Journal& journal, const RunRequest& request) {
  try {
    return unchanged(published_session(journal, request.cell, std::nullopt));
  } catch (const NothingToCheck&) {
    throw RequestError(fmt::format(
        "no published calibration of {}: nothing to update. Run a full session first: 'cellcal run --cell {}'",
        request.cell.string(), shell_word(request.cell.string())));
  }
}

calib::Calibration last_of(const TaskInputs& inputs) {
  if (!inputs.compared)
    throw calib::IdentifyError(
        calib::IdentifyError::Kind::kCalibration,
        "the calibration that this update is based on is no longer published. Run a full session: "
        "'cellcal run --cell CELL'");
  return calib::calibration_from_json(inputs.compared->calibration, inputs.compared->words);
}

/// Used by the worker only, job after job.
class Update {
 public:
  explicit Update(std::shared_ptr<const TaskInputs> inputs)
      : inputs_(std::move(inputs)), last_(last_of(*inputs_)), round_(inputs_, last_) {}

  Tasks::Planned begin() {
    round_.add(calib::make_check_plan(round_.calibration(), inputs_->options.plan,
                                      calib::first_update_touches()));
    return {{}, "", round_.progress()};
  }

  Tasks::Chosen choose(const ChooseTouch& how, const std::vector<calib::Touch>& touches,
                       const calib::JointVector& from) {
    round_.learn(how, touches);
    if (round_.all_done() && !further_) add_further(touches, from);
    Tasks::Chosen chosen = round_.offer(from, how.in_contact);
    chosen.stage = further_ ? "say.stage.resolving" : "say.stage.checking";
    return chosen;
  }

  calib::Calibration result(const std::vector<calib::Touch>& touches) const {
    return estimate_update(inputs_->files, touches, *inputs_->compared, inputs_->options.months,
                           not_found());
  }

 private:
  std::vector<std::string> not_found() const {
    std::vector<std::string> ids;
    for (std::size_t i = 0; i < round_.plan().touches.size(); ++i) {
      const std::string& id = round_.plan().touches[i].target;
      if (round_.became(i) == PlannedRound::Became::kMissed &&
          std::ranges::find(ids, id) == ids.end())
        ids.push_back(id);
    }
    return ids;
  }

  void add_further(const std::vector<calib::Touch>& touches, const calib::JointVector& from) {
    further_ = true;
    const calib::Calibration so_far = calib::update(
        last_, touches, {inputs_->compared->words, inputs_->options.months, not_found(), kPoses});
    const bool pays = not_found().empty() && touches.size() >= calib::kLeastUpdateTouches &&
                      calib::further_touches_pay(*so_far.update);
    if (!pays) return;
    calib::Pace pace;
    pace.predicted_m = calib::first_update_touches().before_m;
    auto how =
        calib::further_update_touches(static_cast<int>(touches.size()),
                                      calib::duration_s(round_.plan(), inputs_->cell.robot, pace));
    const auto& [arm_rad, positioner_rad] = parted(inputs_->cell.robot, from);
    how.positioner_rad = positioner_rad;
    if (how.most_touches < how.least_touches) return;
    const calib::Calibration known = round_.calibration();
    try {
      round_.know(so_far);
      round_.add(
          calib::make_update_plan(round_.calibration(), inputs_->options.plan, how, arm_rad));
    } catch (const calib::PlanError& error) {  // continues with the existing touches
      round_.know(known);
      inputs_->note(fmt::format("no further touches: {}", error.what()));
    }
  }

  static constexpr int kPoses = 60;  ///< as elsewhere in planning
  std::shared_ptr<const TaskInputs> inputs_;
  calib::Calibration last_;
  PlannedRound round_;
  bool further_ = false;
};

class UpdateKind : public Kind {
 public:
  Parameters parameters() const override {
    return {.refusal = "an update has its own touches: leave goal_mm, find and touches out"};
  }

  std::string command(const SessionOptions& options, const SessionInputs& inputs) const override {
    return fmt::format("cellcal run --cell {} --update{}", shell_word(inputs.cell_name),
                       options.accept_change ? " --accept-change" : "");
  }

  void begin(Journal& journal, const RunRequest& request, Job& job) const override {
    const SessionRecord last = calibration_to_update(journal, request);
    job.inputs = last.inputs;
    job.options.against = last.id;
    job.last_ended = last.ended;
  }

  std::optional<Compared> compared(Journal& journal, const Job& job) const override {
    return last_calibration(journal, job.inputs.cell_name, job.session, job.options.accept_change);
  }

  void adapt(State& first, const Job& job) const override {
    expect_contacts(first, job.cell);
    // The arm has changed, so contacts surprise; an outlier is rejected against the other touches.
    first.policy.surprise_sigmas = std::numeric_limits<double>::max();
  }

  /// The touches of a check, further ones depending on their result, and a calibration based on the last one. Throws
  /// calib::IdentifyError without a calibration to compare with.
  Tasks tasks(const SharedInputs& inputs) const override {
    const auto update = std::make_shared<Update>(inputs);
    Tasks tasks;
    tasks.plan = [update] { return update->begin(); };
    tasks.choose = [update](const ChooseTouch& how, const std::vector<calib::Touch>& touches,
                            const calib::JointVector& from) {
      return update->choose(how, touches, from);
    };
    tasks.identify = [update](const std::vector<calib::Touch>& touches) {
      return SessionResult{update->result(touches)};
    };
    tasks.report = [inputs](const SessionResult& result, const std::vector<calib::Touch>& touches) {
      const calib::Calibration& calibration = *result.calibration();
      write_results(*inputs, calibration, touches, std::nullopt);
      for (const std::string& words : calib::words(calibration.verdict.findings))
        inputs->note(words);
    };
    return tasks;
  }
};

}  // namespace

const Kind& update_kind() {
  static const UpdateKind kind;
  return kind;
}

}  // namespace cellcal::daemon
