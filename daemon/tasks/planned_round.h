#pragma once
// A few touches that were planned ahead by a calibration: offered one after the other with a way from wherever the
// arm stands, and what became of each.

#include <memory>
#include <optional>
#include <vector>

#include "daemon/tasks/tasks.h"

namespace cellcal::daemon {

/// Used by the worker alone, job after job.
class PlannedRound {
 public:
  enum class Became { kOpen, kMade, kMissed, kSetAside };

  /// `calibration`: by which the ways are made; what stands in the cell now is what must not be hit now.
  PlannedRound(std::shared_ptr<const TaskInputs> inputs, const calib::Calibration& calibration);

  /// From now on ways are made by this one.
  void know(const calib::Calibration& calibration);
  const calib::Calibration& calibration() const { return calibration_; }
  const calib::Plan& plan() const { return plan_; }
  Became became(std::size_t planned) const { return became_[planned]; }
  /// Index of the one that was made; none where none was.
  std::optional<std::size_t> touch_of(std::size_t planned) const { return touch_of_[planned]; }
  bool all_done() const;

  /// Behind those there are. Throws calib::PlanError where the controller's session does not reach them; nothing is added then.
  void add(calib::Plan plan);
  /// What became of the one in hand.
  void learn(const ChooseTouch& how, const std::vector<calib::Touch>& touches);
  /// The next open one, or the way home where the arm stands at its beginning.
  Tasks::Chosen offer(const calib::JointVector& from);
  calib::Progress progress() const;

  /// Which planned touch that one is of, made in this session or another by the same plan.
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
  calib::JointVector begin_;  ///< of the controller's session
};

}  // namespace cellcal::daemon
