#include "daemon/tasks/planned_round.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "calib/plan/check_plan.h"

namespace cellcal::daemon {

namespace {

/// A touch matches a planned one if no axis is farther from the end of its line: a few centimetres.
constexpr double kOfItsLineRad = 0.08;
/// Occasional bad contacts are no change: retried once.
constexpr int kTries = 2;

double off_rad(const calib::JointVector& one, const calib::JointVector& other) {
  double most = 0.0;
  for (std::size_t i = 0; i < one.size(); ++i) most = std::max(most, std::abs(one[i] - other[i]));
  return most;
}

}  // namespace

PlannedRound::PlannedRound(std::shared_ptr<const TaskInputs> inputs,
                           const calib::Calibration& calibration)
    : inputs_(std::move(inputs)) {
  know(calibration);
}

void PlannedRound::know(const calib::Calibration& calibration) {
  calibration_ = calibration;
  calibration_.cell.obstacles = inputs_->cell.obstacles;
  calibration_.cell.floor_m = inputs_->cell.floor_m;
  calibration_.cell.passable = inputs_->cell.passable;
}

bool PlannedRound::all_done() const {
  return std::ranges::find(became_, Became::kOpen) == became_.end();
}

void PlannedRound::add(calib::Plan plan) {
  const std::size_t first = plan_.touches.size();
  // Checked first: a plan that is refused is not offered.
  if (!begin_.empty()) refuse_beyond_reach(*inputs_, plan, 0, begin_);
  if (first == 0) {
    plan_ = std::move(plan);
  } else {
    // Returns along the paths of both plans, where they join; otherwise the arm stays in place.
    const bool joins = !plan.home.empty() && plan.home.back() == plan_.touches.back().clear;
    if (joins) plan.home.insert(plan.home.end(), plan_.home.begin(), plan_.home.end());
    plan_.home = std::move(plan.home);
    for (calib::PlannedTouch& touch : plan.touches) plan_.touches.push_back(std::move(touch));
  }
  became_.resize(plan_.touches.size(), Became::kOpen);
  tries_.resize(plan_.touches.size(), 0);
  touch_of_.resize(plan_.touches.size());
}

void PlannedRound::learn(const ChooseTouch& how, const std::vector<calib::Touch>& touches) {
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

Tasks::Chosen PlannedRound::offer(const calib::JointVector& from) {
  if (begin_.empty()) {
    begin_ = from;
    refuse_beyond_reach(*inputs_, plan_, 0, begin_);
  }
  Tasks::Chosen chosen;
  const auto next = std::ranges::find(became_, Became::kOpen);
  if (next != became_.end()) {
    in_hand_ = static_cast<std::size_t>(next - became_.begin());
    chosen.plan.touches.push_back(calib::check_touch_from(calibration_, plan_, *in_hand_, from));
    refuse_beyond_reach(*inputs_, chosen.plan, 0,
                        begin_);  // its path may differ from the planned one
  } else if (!plan_.touches.empty() && from == plan_.touches.back().clear) {
    chosen.plan.home = plan_.home;
  }
  chosen.progress = progress();
  return chosen;
}

std::optional<std::size_t> PlannedRound::planned_of(const calib::Touch& touch) const {
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

calib::Progress PlannedRound::progress() const {
  calib::Progress progress;
  progress.touches = static_cast<int>(std::ranges::count(became_, Became::kMade));
  progress.checks_left = static_cast<int>(std::ranges::count(became_, Became::kOpen));
  progress.fitted = true;
  progress.done = progress.checks_left == 0;
  return progress;
}

}  // namespace cellcal::daemon
