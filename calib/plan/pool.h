#pragma once
// The pool of a choice of touches: the candidates of a cell and the paths to them.

#include <functional>

#include "calib/plan/candidates.h"
#include "calib/plan/route.h"

namespace cellcal::calib {

/// The arm without identification-only properties: plans are made on nominal geometry.
ArmModel planning_arm(const Cell& cell);
/// True where the tool may be asked for in any orientation: an arm of six or more joints.
bool reaches_any_turn(const Robot& robot);
/// Throws PlanError for an arm of fewer.
void require_any_turn(const Robot& robot);

/// A posture well inside the limits: centred, with the arm reaching forward and up.
JointVector middle_posture(const Robot& robot);
/// The middle posture, or one close to it without collision, with the tool on another side where it has to be; the
/// middle posture if there is none.
JointVector resting_posture(const Robot& robot, const Clearance& clearance);
JointVector resting_posture(const Robot& robot,
                            const std::function<bool(const JointVector&)>& is_clear);

PlannedTouch to_planned(const Cell& cell, const Candidate& c, TouchSet set,
                        const PlanOptions& options);

class Pool {
 public:
  /// About `per_target` candidates each. Throws PlanError if one of these targets cannot be touched
  /// at all. `rest`: resting posture between touches; empty: resting_posture(). Refers to the cell.
  Pool(const Cell& cell, const PlanOptions& options, int per_target, Kinds kinds = Kinds::kSpheres,
       JointVector rest = {});
  Pool(const Pool&) = delete;  // members refer to each other

  const std::vector<Candidate>& candidates() const { return candidates_; }
  const ArmModel& arm() const { return arm_; }
  const Clearance& clearance() const { return clearance_; }
  const Router& router() const { return router_; }
  /// Resting posture between touches.
  const JointVector& middle() const { return middle_; }
  /// True if clear paths lead from the resting posture to the candidate and back. Computed on the
  /// first call.
  bool connected(std::size_t candidate);
  /// Appends about `count` variations of these candidates in total (candidates.h, vary).
  void vary(const std::vector<std::size_t>& like, int count, double by_rad, Random& random);
  /// Removes all candidates from `first` on except `kept`; returns their new indices.
  std::vector<std::size_t> forget(std::size_t first, std::vector<std::size_t> kept);
  /// Allows sampled paths (route.h) for candidates of this target without a simple one; false if
  /// there are none. Automatic for a sphere without any simple path.
  bool try_harder(std::size_t target);

 private:
  bool any_connected(std::size_t target);

  const Cell& cell_;
  ArmModel arm_;
  Clearance clearance_;
  JointVector middle_;
  Router router_;
  std::vector<Candidate> candidates_;
  std::vector<signed char> connected_;  ///< -1: not computed
  PlanOptions options_;
};

}  // namespace cellcal::calib
