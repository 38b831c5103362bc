#include "daemon/tasks/check_tasks.h"

#include <fmt/format.h>

#include <algorithm>

#include "calib/check/tcp_check.h"
#include "calib/plan/check_plan.h"
#include "calib/result/tcp_check.h"
#include "daemon/tasks/planned_round.h"
#include "daemon/tasks/tasks.h"

namespace cellcal::daemon {

namespace {

/// Plan of a check, and the results of its touches. Used by the worker only, job after job.
class Round {
 public:
  explicit Round(std::shared_ptr<const TaskInputs> inputs)
      : inputs_(std::move(inputs)), round_(inputs_, *inputs_->against) {}

  Tasks::Planned begin() {
    round_.add(calib::make_check_plan(round_.calibration(), inputs_->options.plan));
    return {{}, "", round_.progress()};
  }

  Tasks::Chosen choose(const ChooseTouch& how, const std::vector<calib::Touch>& touches,
                       const calib::JointVector& from) {
    round_.learn(how, touches);
    Tasks::Chosen chosen = round_.offer(from);
    chosen.stage = "checking";
    return chosen;
  }

  calib::TcpCheck judge(const std::vector<calib::Touch>& touches) const {
    std::vector<calib::Touch> made;
    std::vector<std::size_t> planned;
    std::vector<calib::MissedTouch> missed;
    std::vector<calib::UnsteadyTouch> unsteady;
    for (std::size_t i = 0; i < round_.plan().touches.size(); ++i) {
      if (const auto touch = round_.touch_of(i)) {
        made.push_back(touches.at(*touch));
        planned.push_back(i);
      } else if (round_.became(i) == PlannedRound::Became::kMissed) {
        calib::MissedTouch one{i, {}};
        one.at_end.target = round_.plan().touches[i].target;
        one.at_end.joint_rad = round_.plan().touches[i].end;
        missed.push_back(std::move(one));
      } else {
        unsteady.push_back({i, round_.plan().touches[i].target});
      }
    }
    calib::TcpCheck check =
        calib::check_tcp(round_.calibration(), made, planned, missed, references(planned));
    check.holds &= unsteady.empty();
    check.unsteady = std::move(unsteady);
    return check;
  }

  std::size_t references_counted() const { return references_taken_; }

 private:
  /// One per planned touch; null where none was made.
  std::vector<const calib::Touch*> in_order(const std::vector<calib::Touch>& touches) const {
    std::vector<const calib::Touch*> ordered(round_.plan().touches.size(), nullptr);
    for (const calib::Touch& touch : touches)
      if (const auto planned = round_.planned_of(touch)) ordered[*planned] = &touch;
    return ordered;
  }

  /// Touches of earlier checks that hold by themselves, restricted to the touches made now.
  std::vector<std::vector<calib::Touch>> references(const std::vector<std::size_t>& planned) const {
    std::vector<std::vector<calib::Touch>> all;
    if (planned.size() < calib::kLeastCheckTouches) return all;
    for (const std::vector<calib::Touch>& touches : inputs_->checks_before) {
      if (all.size() == calib::kMostReferences) break;
      const auto ordered = in_order(touches);
      if (std::ranges::find(ordered, nullptr) != ordered.end()) continue;
      std::vector<calib::Touch> same;
      for (const std::size_t i : planned) same.push_back(*ordered[i]);
      if (calib::TcpChecker(round_.calibration(), same, all).judge(same).holds)
        all.push_back(std::move(same));
    }
    references_taken_ = all.size();
    return all;
  }

  std::shared_ptr<const TaskInputs> inputs_;
  PlannedRound round_;
  mutable std::size_t references_taken_ = 0;
};

}  // namespace

Tasks check_tasks(std::shared_ptr<const TaskInputs> inputs) {
  const auto round = std::make_shared<Round>(inputs);
  Tasks tasks;
  tasks.plan = [round] { return round->begin(); };
  tasks.choose = [round](const ChooseTouch& how, const std::vector<calib::Touch>& touches,
                         const calib::JointVector& from) {
    return round->choose(how, touches, from);
  };
  tasks.assess = [](const std::vector<calib::Touch>&) { return Tasks::Assessed{}; };
  tasks.identify = [round](const std::vector<calib::Touch>& touches) {
    return SessionResult{round->judge(touches)};
  };
  tasks.report = [inputs, round](const SessionResult& result,
                                 const std::vector<calib::Touch>& touches) {
    const auto& check = std::get<calib::TcpCheck>(result.of);
    write_document(*inputs, result, touches, "check.json");
    inputs->note(fmt::format("check against session {} and {} checks before it: {}",
                             inputs->options.against, round->references_counted(),
                             calib::verdict_words(check)));
    if (const std::string change = calib::change_words(check); !change.empty())
      inputs->note(change);
  };
  return tasks;
}

}  // namespace cellcal::daemon
