#pragma once
// The way from one place to a stand-off: the fastest that is clear of the straight one in joint
// space, those half-way round the sphere and those over points above the spheres, otherwise over
// the resting posture; then pulled towards the straight one as far as it stays clear. Where a target is
// marked as hard to reach, ways between it and the resting posture are sampled as a last resort
// (detour.h). One that was found serves the target's other touches, too.

#include <optional>
#include <vector>

#include "calib/plan/candidates.h"
#include "calib/plan/clearance.h"
#include "calib/plan/planned_touch.h"

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
        margin_rad_(limit_margin_rad),
        hard_(cell.targets.size()) {}

  /// From now on ways to this target may be sampled.
  void mark_hard(std::size_t target) { hard_[target].allowed = true; }

  /// Finds the candidate's ways from and to the resting posture; false where there is none. With
  /// them a way between any two candidates exists.
  bool connect(Candidate& candidate) const;
  /// Waypoints from `from` (not among them) to `to.standoff` (the last). `leaving`: the sphere that
  /// the arm leaves, if any. Empty where no way was found: to a candidate that is connected only
  /// where none leads from `from` to the resting posture.
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
  /// Half-way round the sphere that both touch.
  std::optional<JointVector> around(const Candidate& leaving, const Candidate& to,
                                    double times) const;
  /// About, with a robot whose speeds are stated.
  double seconds(const JointVector& from, const std::vector<JointVector>& chain) const;
  /// The clear way with its way-points nearer to the straight one, or without them. Clear as well.
  std::vector<JointVector> shortened(const JointVector& from, std::vector<JointVector> way) const;
  std::optional<std::vector<JointVector>> any_way(const JointVector& from, const Candidate* leaving,
                                                  const Candidate& to) const;
  struct KnownMove {
    JointVector from, to;
    bool clear;
  };
  using Known = std::vector<KnownMove>;
  /// `known`: moves that were looked at; those of this chain are added.
  bool clear_chain(const JointVector& from, const std::vector<JointVector>& chain,
                   Known* known = nullptr) const;
  std::optional<std::vector<JointVector>> simple_way(const JointVector& from,
                                                     const Candidate* leaving,
                                                     const Candidate& to) const;
  std::optional<std::vector<JointVector>> sampled_way(const Candidate& to) const;
  std::vector<JointVector> detour(const JointVector& from, const JointVector& to,
                                  int most_steps) const;

  const Cell& cell_;
  const ArmModel& arm_;
  const Clearance& clearance_;
  JointVector rest_;
  double margin_rad_;
  struct Hard {
    bool allowed = false;
    int failed = 0;                               ///< in a row
    std::vector<std::vector<JointVector>> found;  ///< from the resting posture to stand-offs
  };
  struct Back {
    JointVector from;
    std::vector<JointVector> way;  ///< to the resting posture; empty: none was found
  };
  /// The last that was sampled: whoever asks for many candidates asks from one place.
  mutable std::optional<Back> back_;
  mutable std::vector<Hard> hard_;  ///< per target; what was sampled is kept for the next
};

// A way by sampling, for where the simple ones fail (route.h): two trees of straight joint-space
// moves grow from both ends until they meet (RRT-Connect, by OMPL). Slow, bounded in effort, and
// not sure to find what there is.

struct DetourOptions {
  double tip_margin_m = 0.0;
  double limit_margin_rad = 0.0;  ///< an end that lies beyond it stays where it is
  int most_steps = 4000;          ///< of the trees; each costs a look at a move or two
  unsigned seed = 1;
};

struct Detour {
  std::vector<JointVector> way;  ///< waypoints from `from` (not among them) to `to`; empty: none
  int steps = 0;                 ///< that it took
};

/// Both ends must be clear. Every move of the way was found clear by `clearance`, and corners that
/// are not needed are cut. The same for the same input.
Detour find_detour(const Robot& robot, const Clearance& clearance, const JointVector& from,
                   const JointVector& to, const DetourOptions& options);

// How far before and behind a way-point the arm may leave the legs that were found clear, so that it
// need not stop there.

/// Fills the touch's corners. `from`: where its transit begins; `before`: the farthest that the arm
/// may come from to there, on a straight line; empty: it begins at rest.
void round_corners(const Clearance& clearance, const JointVector& before, const JointVector& from,
                   PlannedTouch& touch);

}  // namespace cellcal::calib
