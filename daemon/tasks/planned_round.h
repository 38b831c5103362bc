#pragma once
// A few touches planned ahead with a calibration: offered one by one with a path from the arm's current
// position, and their results.

#include <memory>
#include <optional>
#include <vector>

#include "daemon/tasks/tasks.h"

namespace cellcal::daemon {

/// Used by the worker only, job after job.
class PlannedRound {
 public:
  enum class Became { kOpen, kMade, kMissed, kSetAside };

  /// `calibration`: used for the paths. Obstacles are those currently in the cell.
  PlannedRound(std::shared_ptr<const TaskInputs> inputs, const calib::Calibration& calibration);

  /// Replaces the calibration used for the paths.
  void know(const calib::Calibration& calibration);
  const calib::Calibration& calibration() const { return calibration_; }
  const calib::Plan& plan() const { return plan_; }
  Became became(std::size_t planned) const { return became_[planned]; }
  /// Index of the touch made; none where none was made.
  std::optional<std::size_t> touch_of(std::size_t planned) const { return touch_of_[planned]; }
  bool all_done() const;

  /// Appends the touches. Throws calib::PlanError, without any change, where the controller's session cannot
  /// reach them.
  void add(calib::Plan plan);
  /// Records the result of the current touch.
  void learn(const ChooseTouch& how, const std::vector<calib::Touch>& touches);
  /// The next open touch, or the way home if the arm is at its beginning.
  Tasks::Chosen offer(const calib::JointVector& from);
  calib::Progress progress() const;

  /// The planned touch that matches, made in this session or another one with the same plan.
  std::optional<std::size_t> planned_of(const calib::Touch& touch) const;

 private:
  std::shared_ptr<const TaskInputs> inputs_;
  calib::Calibration calibration_;
  calib::Plan plan_;
  std::vector<Became> became_;
  std::vector<int> tries_;
  std::vector<std::optional<std::size_t>> touch_of_;
  std::size_t learnt_ = 0;
  std::optional<std::size_t> in_hand_;
  calib::JointVector begin_;  ///< position at the begin of the controller's session
};

}  // namespace cellcal::daemon
