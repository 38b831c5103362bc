#pragma once
// The way from one place to a stand-off: straight in joint space where that is clear, otherwise
// over points above the spheres.

#include <optional>

#include "calib/plan/candidates.h"

namespace cellcal::calib {

class Router {
 public:
  /// `rest`: a free posture that long ways may lead over.
  Router(const Cell& cell, const ArmModel& arm, const Clearance& clearance, JointVector rest,
         double limit_margin_rad)
      : cell_(cell),
        arm_(arm),
        clearance_(clearance),
        rest_(std::move(rest)),
        margin_rad_(limit_margin_rad) {}

  /// Finds the candidate's ways from and to the resting posture; false where there is none. With
  /// them a way between any two candidates exists.
  bool connect(Candidate& candidate) const;
  /// Waypoints from `from` (not among them) to `to.standoff` (the last). `leaving`: the sphere that
  /// the arm leaves, if any. Empty where no way was found.
  std::optional<std::vector<JointVector>> to_standoff(const JointVector& from,
                                                      const Candidate* leaving,
                                                      const Candidate& to) const;
  /// Waypoints from a clear point to a free posture.
  std::optional<std::vector<JointVector>> away(const Candidate& leaving,
                                               const JointVector& to) const;

 private:
  /// The tip lifted to `height_m` above the candidate's sphere, tool held as for the touch.
  std::optional<JointVector> above(const Candidate& candidate, double height_m,
                                   const JointVector& seed) const;
  bool clear_chain(const JointVector& from, const std::vector<JointVector>& chain) const;

  const Cell& cell_;
  const ArmModel& arm_;
  const Clearance& clearance_;
  JointVector rest_;
  double margin_rad_;
};

}  // namespace cellcal::calib
