#pragma once
// What a choice of touches can choose from: the candidates of a cell and the ways to them.

#include "calib/plan/candidates.h"
#include "calib/plan/route.h"

namespace cellcal::calib {

/// The arm without what only matters for identification: plans are made on nominal geometry.
ArmModel planning_arm(const Cell& cell);

/// A posture well inside the limits: half-way, with the arm reaching forward and up.
JointVector middle_posture(const Robot& robot);
/// The same, or near it, where nothing is in the way; where something always is, the same.
JointVector resting_posture(const Robot& robot, const Clearance& clearance);

PlannedTouch to_planned(const Cell& cell, const Candidate& c, TouchSet set,
                        const PlanOptions& options);

class Pool {
 public:
  /// About `per_target` candidates each. Throws PlanError where one of these targets cannot be
  /// touched at all. Refers to the cell.
  Pool(const Cell& cell, const PlanOptions& options, int per_target, Kinds kinds = Kinds::kSpheres);
  Pool(const Pool&) = delete;  // parts refer to each other

  const std::vector<Candidate>& candidates() const { return candidates_; }
  int spheres() const { return spheres_; }
  const ArmModel& arm() const { return arm_; }
  const Clearance& clearance() const { return clearance_; }
  const Router& router() const { return router_; }
  /// Where the arm rests between touches.
  const JointVector& middle() const { return middle_; }
  /// Whether clear ways lead from the resting posture to the candidate and back. Sought when first
  /// asked for.
  bool connected(std::size_t candidate);
  /// Adds candidates like these (candidates.h, vary), about `count` in all; behind those there are.
  void vary(const std::vector<std::size_t>& like, int count, double by_rad, Random& random);
  /// Forgets all candidates from `first` on but `kept`; returns where those are now.
  std::vector<std::size_t> forget(std::size_t first, std::vector<std::size_t> kept);
  /// From now on ways to candidates of this target that had none are sampled (detour.h); false
  /// where there are none. Done without being asked for a sphere that no simple way leads to.
  bool try_harder(std::size_t target);

 private:
  bool any_connected(std::size_t target);

  const Cell& cell_;
  ArmModel arm_;
  Clearance clearance_;
  JointVector middle_;
  Router router_;
  int spheres_ = 0;
  std::vector<Candidate> candidates_;
  std::vector<signed char> connected_;  ///< -1: not asked yet
  PlanOptions options_;
};

}  // namespace cellcal::calib
