#include "daemon/tasks/update_tasks.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "calib/files/calibration_json.h"
#include "calib/identify/update.h"
#include "calib/model/error.h"
#include "calib/plan/check_plan.h"
#include "calib/plan/duration.h"
#include "calib/result/finding.h"
#include "daemon/tasks/options.h"
#include "daemon/tasks/planned_round.h"
#include "daemon/tasks/tasks.h"

namespace cellcal::daemon {

namespace {

calib::Calibration last_of(const TaskInputs& inputs) {
  if (!inputs.compared)
    throw calib::IdentifyError(
        calib::IdentifyError::Kind::kCalibration,
        "the calibration that this update is based on is no longer published. Run a full session: "
        "'cellcal run'");
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
    Tasks::Chosen chosen = round_.offer(from);
    chosen.stage = further_ ? "resolving what changed" : "checking";
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
    const auto how =
        calib::further_update_touches(static_cast<int>(touches.size()),
                                      calib::duration_s(round_.plan(), inputs_->cell.robot, pace));
    if (how.most_touches < how.least_touches) return;
    const calib::Calibration known = round_.calibration();
    try {
      round_.know(so_far);
      round_.add(calib::make_update_plan(round_.calibration(), inputs_->options.plan, how, from));
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

}  // namespace

Tasks update_tasks(std::shared_ptr<const TaskInputs> inputs) {
  const auto update = std::make_shared<Update>(inputs);
  Tasks tasks;
  tasks.plan = [update] { return update->begin(); };
  tasks.choose = [update](const ChooseTouch& how, const std::vector<calib::Touch>& touches,
                          const calib::JointVector& from) {
    return update->choose(how, touches, from);
  };
  tasks.assess = [](const std::vector<calib::Touch>&) { return Tasks::Assessed{}; };
  tasks.identify = [update](const std::vector<calib::Touch>& touches) {
    return SessionResult{update->result(touches)};
  };
  tasks.report = [inputs](const SessionResult& result, const std::vector<calib::Touch>& touches) {
    const calib::Calibration& calibration = *result.calibration();
    write_results(*inputs, calibration, touches, std::nullopt);
    for (const std::string& words : calib::words(calibration.verdict.findings)) inputs->note(words);
  };
  return tasks;
}

}  // namespace cellcal::daemon
