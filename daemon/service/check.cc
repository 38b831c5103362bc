#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "calib/check/mastered.h"
#include "calib/check/tcp_check.h"
#include "calib/model/error.h"
#include "calib/plan/check_plan.h"
#include "calib/plan/duration.h"
#include "calib/result/tcp_check.h"
#include "daemon/service/kind.h"
#include "daemon/tasks/planned_round.h"

namespace cellcal::daemon {

namespace {

/// Session record of the calibration to check.
SessionRecord calibration_to_check(Journal& journal, const RunRequest& request) {
  try {
    return unchanged(published_session(journal, request.cell, request.calibration));
  } catch (const NothingToCheck& nothing) {
    throw RequestError(nothing.what());
  }
}

/// Before anything is opened: the joints are those of the robot, and touches determine their zeros.
void check_mastered(Journal& journal, const SessionOptions& options) {
  if (options.mastered.empty()) return;
  try {
    (void)calib::as_mastered(calibration_of(journal, options.against), options.mastered);
  } catch (const calib::IdentifyError& wrong) {
    throw RequestError(wrong.what());
  }
}

/// Plan of a check, and the results of its touches. Used by the worker only, job after job.
class Round {
 public:
  explicit Round(std::shared_ptr<const TaskInputs> inputs)
      : inputs_(std::move(inputs)), round_(inputs_, *inputs_->against) {}

  Tasks::Planned begin() {
    round_.add(calib::make_check_plan(
        round_.calibration(), inputs_->options.plan,
        mastered().empty() ? calib::CheckPlanOptions() : calib::mastered_touches(mastered())));
    return {{}, "", round_.progress()};
  }

  Tasks::Chosen choose(const ChooseTouch& how, const std::vector<calib::Touch>& touches,
                       const calib::JointVector& from) {
    round_.learn(how, touches);
    Tasks::Chosen chosen = round_.offer(from, how.in_contact);
    chosen.stage = "say.stage.checking";
    return chosen;
  }

  SessionResult judge(const std::vector<calib::Touch>& touches) const {
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
        one.at_end.load = inputs_->options.load;
        one.at_end.joint_rad = round_.plan().touches[i].end;
        one.at_end.positioner_rad = round_.plan().touches[i].positioner_rad;
        missed.push_back(std::move(one));
      } else {
        unsteady.push_back({i, round_.plan().touches[i].target});
      }
    }
    calib::TcpCheck check =
        calib::check_tcp(round_.calibration(), made, planned, missed, references(planned));
    check.holds &= unsteady.empty();
    check.unsteady = std::move(unsteady);
    std::vector<calib::MasteredZero> zeros;
    if (!mastered().empty() && made.size() >= calib::kLeastCheckTouches)
      zeros = calib::zeros_left(round_.calibration(), mastered(), made);
    check.zeros_hold = std::ranges::all_of(zeros, &calib::MasteredZero::holds);
    check.holds &= check.zeros_hold;
    return {std::move(check), std::move(zeros)};
  }

  std::size_t references_counted() const { return references_taken_; }
  double planned_s() const { return calib::duration_s(round_.plan(), inputs_->cell.robot, {}); }

 private:
  const std::vector<std::string>& mastered() const { return inputs_->options.mastered; }

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

class CheckKind : public Kind {
 public:
  Parameters parameters() const override {
    return {.compares = true,
            .refusal = "a check has its own touches: leave goal_mm, find and touches out"};
  }

  std::string command(const SessionOptions& options, const SessionInputs&) const override {
    std::string command = fmt::format("cellcal check --calibration {}", options.against);
    if (!options.mastered.empty())
      command += fmt::format(" --mastered {}", fmt::join(options.mastered, ","));
    if (options.temperature_c) command += fmt::format(" --temperature {}", *options.temperature_c);
    return command;
  }

  void begin(Journal& journal, const RunRequest& request, Job& job) const override {
    const SessionRecord calibrated = calibration_to_check(journal, request);
    job.inputs = calibrated.inputs;
    job.options.against = calibrated.id;
    job.options.temperature_c = request.temperature_c;
    job.options.mastered = request.mastered;
    check_mastered(journal, job.options);
  }

  void adapt(State& first, const Job& job) const override { expect_contacts(first, job.cell); }

  void add_inputs(TaskInputs& inputs, Journal& journal, const Job& job) const override {
    inputs.against = std::make_shared<const calib::Calibration>(
        calib::as_mastered(calibration_of(journal, job.options.against), job.options.mastered));
    if (job.options.mastered.empty())
      inputs.checks_before =
          checks_before(journal, job.options.against, job.session, job.options.load);
  }

  /// Planning, touches one by one, and results: touches.csv and check.json, no calibration. A touch without contact is
  /// a result, and the next one follows.
  Tasks tasks(const SharedInputs& inputs) const override {
    const auto round = std::make_shared<Round>(inputs);
    Tasks tasks;
    tasks.plan = [round] { return round->begin(); };
    tasks.choose = [round](const ChooseTouch& how, const std::vector<calib::Touch>& touches,
                           const calib::JointVector& from) {
      return round->choose(how, touches, from);
    };
    tasks.identify = [round](const std::vector<calib::Touch>& touches) {
      return round->judge(touches);
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
      for (const calib::MasteredZero& zero : result.mastered)
        inputs->note(calib::words(phrase(zero)));
      if (!inputs->options.mastered.empty())
        inputs->note(fmt::format("check after mastering {}: {} touches, {:.1f} s planned",
                                 fmt::join(inputs->options.mastered, ", "), check.touches,
                                 round->planned_s()));
    };
    return tasks;
  }
};

}  // namespace

const Kind& check_kind() {
  static const CheckKind kind;
  return kind;
}

}  // namespace cellcal::daemon
