#pragma once
// Paths to a stand-off: the fastest clear one of the straight line in joint space, those halfway around
// the sphere and those via points above the spheres, otherwise via the resting posture; then pulled
// towards the straight line while it stays clear. For a target marked as hard to reach, paths between
// it and the resting posture are sampled as a last resort (find_detour), and reused for the target's other
// touches.

#include <optional>
#include <vector>

#include "calib/plan/candidates.h"
#include "calib/plan/clearance.h"
#include "calib/plan/planned_touch.h"

namespace cellcal::calib {

/// True where no axis is farther than 1e-4 rad or 0.1 mm from the place: a way that begins there may be taken.
bool is_at(const JointVector& place, const JointVector& arm);

class Router {
 public:
  /// `rest`: a clear posture for long paths.
  Router(const Cell& cell, const ArmModel& arm, const Clearance& clearance, JointVector rest,
         double limit_margin_rad)
      : cell_(cell),
        arm_(arm),
        clearance_(clearance),
        rest_(std::move(rest)),
        margin_rad_(limit_margin_rad),
        hard_(cell.targets.size()) {}

  /// Allows sampling of paths to this target.
  void mark_hard(std::size_t target) { hard_[target].allowed = true; }

  /// Finds the candidate's paths from and to the resting posture; false if there are none. They
  /// guarantee a path between any two connected candidates.
  bool connect(Candidate& candidate) const;
  /// Waypoints from `from` (excluded) to `to.standoff` (the last). `leaving`: the sphere that the
  /// arm leaves, if any. Empty if no path was found: for a connected candidate only if none leads
  /// from `from` to the resting posture.
  std::optional<std::vector<JointVector>> to_standoff(const JointVector& from,
                                                      const Candidate* leaving,
                                                      const Candidate& to) const;
  /// Waypoints from a clear point to a clear posture.
  std::optional<std::vector<JointVector>> away(const Candidate& leaving,
                                               const JointVector& to) const;
  /// Waypoints from a clear point to the resting posture, sampled where simple ones fail.
  std::optional<std::vector<JointVector>> to_rest(const Candidate& leaving) const;

 private:
  /// The tip raised to `height_m` above the candidate's sphere, with the tool orientation of the
  /// touch.
  std::optional<JointVector> above(const Candidate& candidate, double height_m,
                                   const JointVector& seed) const;
  /// Halfway around the sphere of both touches.
  std::optional<JointVector> around(const Candidate& leaving, const Candidate& to,
                                    double times) const;
  /// The clear path with its way-points pulled towards the straight line or removed. Clear as well.
  std::vector<JointVector> shortened(const JointVector& from, std::vector<JointVector> way) const;
  std::optional<std::vector<JointVector>> any_way(const JointVector& from, const Candidate* leaving,
                                                  const Candidate& to) const;
  struct KnownMove {
    JointVector from, to;
    bool clear;
  };
  using Known = std::vector<KnownMove>;
  /// `known`: moves already checked; those of this chain are added.
  bool clear_chain(const JointVector& from, const std::vector<JointVector>& chain,
                   Known* known = nullptr) const;
  std::optional<std::vector<JointVector>> simple_way(const JointVector& from,
                                                     const Candidate* leaving,
                                                     const Candidate& to) const;
  std::optional<std::vector<JointVector>> sampled_way(const Candidate& to) const;
  std::vector<JointVector> detour(const JointVector& from, const JointVector& to) const;

  const Cell& cell_;
  const ArmModel& arm_;
  const Clearance& clearance_;
  JointVector rest_;
  double margin_rad_;
  struct Hard {
    bool allowed = false;
    int failed = 0;                               ///< consecutive failures
    std::vector<std::vector<JointVector>> found;  ///< from the resting posture to stand-offs
  };
  struct Back {
    JointVector from;
    std::vector<JointVector> way;  ///< to the resting posture; empty: none
  };
  /// The last one sampled: queries for many candidates usually start from one place.
  mutable std::optional<Back> back_;
  mutable std::vector<Hard> hard_;  ///< per target; sampled paths are kept for the next ones
};

// A sampled path, used if simple ones fail (route.h): two trees of straight joint-space moves grow
// from both ends until they meet (RRT-Connect, by OMPL). Slow, with bounded effort, and incomplete.

struct DetourOptions {
  double limit_margin_rad = 0.0;  ///< an end beyond it is not moved
  int most_steps = 3000;          ///< of the trees; each costs one or two move checks
  unsigned seed = 1;
};

struct Detour {
  std::vector<JointVector> way;  ///< waypoints from `from` (excluded) to `to`; empty: none
  int steps = 0;                 ///< steps used
};

/// Both ends must be clear. Every move of the path is clear by `clearance`, and unnecessary corners
/// are cut. Deterministic.
Detour find_detour(const Robot& robot, const Clearance& clearance, const JointVector& from,
                   const JointVector& to, const DetourOptions& options);

// Blending of way-points: how far before and after them the arm may leave the checked legs instead
// of stopping.

/// Fills the touch's corners. `from`: start of its transit; `before`: the farthest point from which
/// the arm may arrive there, in a straight line; empty: it starts at rest.
void round_corners(const Clearance& clearance, const JointVector& before, const JointVector& from,
                   PlannedTouch& touch);

}  // namespace cellcal::calib
