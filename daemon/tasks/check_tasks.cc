#include "daemon/tasks/check_tasks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calib/check/tcp_check.h"
#include "calib/files/check_json.h"
#include "calib/files/files.h"
#include "calib/plan/check_plan.h"
#include "calib/words/check_words.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

/// A touch is of the planned one whose line's end no axis is farther from than this: some centimetres.
constexpr double kOfItsLineRad = 0.08;

double off_rad(const calib::JointVector& one, const calib::JointVector& other) {
  double most = 0.0;
  for (std::size_t i = 0; i < one.size(); ++i) most = std::max(most, std::abs(one[i] - other[i]));
  return most;
}

/// The plan of a check, and what became of its touches. Used by the worker alone, job after job.
class Round {
 public:
  explicit Round(std::shared_ptr<const TaskInputs> inputs)
      : inputs_(std::move(inputs)), calibration_(*inputs_->against) {
    // What stands in the cell now is what must not be hit now.
    calibration_.cell.obstacles = inputs_->cell.obstacles;
    calibration_.cell.floor_m = inputs_->cell.floor_m;
    calibration_.cell.passable = inputs_->cell.passable;
  }

  Tasks::Planned begin() {
    calib::PlanOptions options = inputs_->options.plan;
    plan_ = calib::make_check_plan(calibration_, options);
    became_.assign(plan_.touches.size(), Became::kOpen);
    tries_.assign(plan_.touches.size(), 0);
    touch_of_.assign(plan_.touches.size(), std::nullopt);
    return {{}, "", progress()};
  }

  Tasks::Chosen choose(const ChooseTouch& how, const std::vector<calib::Touch>& touches,
                       const calib::JointVector& from) {
    if (begin_.empty()) {
      begin_ = from;
      refuse_beyond_reach(*inputs_, plan_, 0, begin_);
    }
    learn(how, touches);
    Tasks::Chosen chosen;
    const auto next = std::ranges::find(became_, Became::kOpen);
    if (next != became_.end()) {
      in_hand_ = static_cast<std::size_t>(next - became_.begin());
      chosen.plan.touches.push_back(
          calib::check_touch_from(calibration_.cell, plan_, *in_hand_, from));
    } else if (!plan_.touches.empty() && from == plan_.touches.back().clear) {
      chosen.plan.home = plan_.home;
    }
    chosen.progress = progress();
    chosen.stage = "checking";
    return chosen;
  }

  calib::TcpCheck judge(const std::vector<calib::Touch>& touches) const {
    std::vector<calib::Touch> made;
    std::vector<std::size_t> planned;
    std::vector<calib::MissedTouch> missed;
    std::vector<calib::UnsteadyTouch> unsteady;
    for (std::size_t i = 0; i < plan_.touches.size(); ++i) {
      if (touch_of_[i]) {
        made.push_back(touches.at(*touch_of_[i]));
        planned.push_back(i);
      } else if (became_[i] == Became::kMissed) {
        calib::MissedTouch one{i, {}};
        one.at_end.target = plan_.touches[i].target;
        one.at_end.joint_rad = plan_.touches[i].end;
        missed.push_back(std::move(one));
      } else {
        unsteady.push_back({i, plan_.touches[i].target});
      }
    }
    calib::TcpCheck check =
        calib::check_tcp(calibration_, made, planned, missed, references(planned));
    check.holds &= unsteady.empty();
    check.unsteady = std::move(unsteady);
    return check;
  }

  std::size_t references_taken() const { return references_taken_; }

 private:
  enum class Became { kOpen, kMade, kMissed, kSetAside };
  /// A bad contact now and then is no change: once more.
  static constexpr int kTries = 2;

  void learn(const ChooseTouch& how, const std::vector<calib::Touch>& touches) {
    if (in_hand_ && how.failed) {
      if (*how.failed == calib::NotMade::kMissed)
        became_[*in_hand_] = Became::kMissed;
      else if (++tries_[*in_hand_] == kTries)
        became_[*in_hand_] = Became::kSetAside;
    }
    for (; learnt_ < touches.size(); ++learnt_) {
      const auto planned = in_hand_ && !how.failed ? in_hand_ : planned_of(touches[learnt_]);
      if (!planned) continue;
      became_[*planned] = Became::kMade;
      touch_of_[*planned] = learnt_;
    }
    in_hand_.reset();
  }

  std::optional<std::size_t> planned_of(const calib::Touch& touch) const {
    std::optional<std::size_t> nearest;
    double least = kOfItsLineRad;
    for (std::size_t i = 0; i < plan_.touches.size(); ++i) {
      if (plan_.touches[i].target != touch.target) continue;
      const double off = off_rad(plan_.touches[i].end, touch.joint_rad);
      if (off >= least) continue;
      least = off;
      nearest = i;
    }
    return nearest;
  }

  /// One for each planned touch; null where none was made.
  std::vector<const calib::Touch*> in_order(const std::vector<calib::Touch>& touches) const {
    std::vector<const calib::Touch*> ordered(plan_.touches.size(), nullptr);
    for (const calib::Touch& touch : touches)
      if (const auto planned = planned_of(touch)) ordered[*planned] = &touch;
    return ordered;
  }

  /// Of earlier checks that held by themselves, with the touches that were made now.
  std::vector<std::vector<calib::Touch>> references(const std::vector<std::size_t>& planned) const {
    std::vector<std::vector<calib::Touch>> all;
    if (planned.size() < calib::kLeastCheckTouches) return all;
    for (const std::vector<calib::Touch>& touches : inputs_->checks_before) {
      if (all.size() == calib::kMostReferences) break;
      const auto ordered = in_order(touches);
      if (std::ranges::find(ordered, nullptr) != ordered.end()) continue;
      std::vector<calib::Touch> same;
      for (const std::size_t i : planned) same.push_back(*ordered[i]);
      if (calib::TcpChecker(calibration_, same, all).judge(same).holds)
        all.push_back(std::move(same));
    }
    references_taken_ = all.size();
    return all;
  }

  calib::Progress progress() const {
    calib::Progress progress;
    progress.touches = static_cast<int>(std::ranges::count(became_, Became::kMade));
    progress.checks_left = static_cast<int>(std::ranges::count(became_, Became::kOpen));
    progress.fitted = true;
    progress.done = progress.checks_left == 0;
    return progress;
  }

  std::shared_ptr<const TaskInputs> inputs_;
  calib::Calibration calibration_;
  calib::Plan plan_;
  std::vector<Became> became_;
  std::vector<int> tries_;
  std::vector<std::optional<std::size_t>> touch_of_;  ///< planned: index of the one made
  std::size_t learnt_ = 0;
  std::optional<std::size_t> in_hand_;
  calib::JointVector begin_;
  mutable std::size_t references_taken_ = 0;
};

}  // namespace

Tasks check_tasks(std::shared_ptr<const TaskInputs> inputs) {
  const auto round = std::make_shared<Round>(inputs);
  const auto result = std::make_shared<calib::TcpCheck>();
  Tasks tasks;
  tasks.plan = [round] { return round->begin(); };
  tasks.choose = [round](const ChooseTouch& how, const std::vector<calib::Touch>& touches,
                         const calib::JointVector& from) {
    return round->choose(how, touches, from);
  };
  tasks.assess = [](const std::vector<calib::Touch>&) { return Tasks::Assessed{}; };
  tasks.identify = [round, result](const std::vector<calib::Touch>& touches) {
    *result = round->judge(touches);
    return calib::Calibration{};  // never one to be used
  };
  tasks.report = [inputs, round, result](const calib::Calibration&,
                                         const std::vector<calib::Touch>& touches) {
    std::filesystem::create_directories(inputs->results_dir);
    write_atomically(inputs->results_dir / "touches.csv",
                     calib::format_touches(touches, inputs->cell.robot));
    write_atomically(inputs->results_dir / "check.json", calib::check_to_json(*result) + "\n");
    inputs->note(fmt::format("check against session {} and {} checks before it: {}",
                             inputs->options.against, round->references_taken(),
                             calib::verdict_words(*result)));
    if (const std::string change = calib::change_words(*result); !change.empty())
      inputs->note(change);
  };
  return tasks;
}

}  // namespace cellcal::daemon
