#pragma once
// Collision check of the arm against spheres, their stands, obstacles, the floor, and itself. Arm and tool are capsules
// on the nominal geometry (bodies.h). Not covered: cables, and objects missing from the cell file. Without a stated
// floor, the axis of the hand stays above the lowest target less 0.1 m.
//
// Margins. 11 mm for the tip (slim end and ball), 20 mm for everything else: an uncalibrated arm is off by up to
// 10 mm. Self-collision is checked between links that are not neighbours. Two bodies closer than their
// margin in more than half of all postures inside the limits are neighbours: their capsules overlap by construction.
// A tool among them comes no more than 20 mm nearer to the link than its place next to the wrist does.
//
// Moves are straight in joint space. At one end of a piece of the move every body's distance is gap_0, at the other end
// gap_1, both at least the margin M_c. No point of the body moves further along the piece than D_max, its levers times
// the turns of the joints. At every intermediate posture its distance is then at least (gap_0 + gap_1 - D_max) / 2. A
// piece is accepted if D_max <= gap_0 + gap_1 - 1.84 M_c, and halved otherwise: on the whole move every body keeps at
// least 0.92 of its margin, and no object, however thin, is missed.
//
// Postures and moves that the cell declares impassable (Cell::passable) count as hits.

#include <optional>
#include <string>

#include "calib/model/hidden.h"
#include "calib/model/joint_vector.h"
#include "calib/model/kinematics.h"
#include "calib/plan/planned_touch.h"

namespace cellcal::calib {

// Obstruction of a posture or a move, and its sentence.

/// Without a floor in the cell file, the axis of the hand stays above the lowest target less this.
inline constexpr double kBelowTargetsM = 0.10;

struct Hit {
  enum class Kind {
    kTooNear,       ///< the body comes closer to the other object than its margin
    kBelowTargets,  ///< the body is too low, without a stated floor
    kImpassable     ///< without a body: near a singularity, or beyond a correction limit
  };
  Kind kind = Kind::kTooNear;
  std::string body = {};          ///< "the forearm (A4)"
  std::string other = {};         ///< kTooNear: "obstacle table"
  double gap_m = 0.0;             ///< kTooNear; 0 or less at intersection
  double assumed_radius_m = 0.0;  ///< of the body; 0: stated

  /// True for a hit of the same objects, at any distance.
  bool is_like(const Hit& hit) const {
    return kind == hit.kind && body == hit.body && other == hit.other;
  }
};

/// "the forearm (A4) comes within 12 mm of obstacle table", and whether its radius is assumed
std::string words(const Hit& hit);
/// `otherwise` if nothing is hit.
std::string words_or(const std::optional<Hit>& hit, const char* otherwise);

// A way-point that need not be visited exactly. A triangle of postures is clear if its centre keeps gap
// and no body moves by more than gap - 0.92 M_c from there to the corners (levers times turns are
// convex, so this holds everywhere), or if the four triangles between its corners and the midpoints of
// its sides are. At each way-point the largest clear triangle is sought, between it and points on both
// legs.

/// Clearance of the nominal tip from every surface in transits; 0.92 of it, 10 mm, within a move.
/// Arms of twice the usual tolerances have been 9 mm off.
inline constexpr double kTipMarginM = 0.011;
/// Margin of everything else.
inline constexpr double kBodyMarginM = 0.02;
/// Share of every margin kept within a move.
inline constexpr double kMarginKept = 0.92;

class Clearance {
 public:
  /// Targets must state their centres. Refers to `arm`. Throws PlanError if an obstacle's mesh is
  /// not loaded.
  Clearance(const Cell& cell, const ArmModel& arm);
  /// Everything is clear; used to determine what is reachable without obstacles.
  static Clearance blind();

  bool clear(const JointVector& q) const;
  bool clear(const JointVector& from, const JointVector& to) const;
  /// The search for target `target` (index into the cell): the tip may touch it and its stand, with
  /// the reduced tool margin of a touch.
  bool clear_search(const JointVector& from, const JointVector& to, std::size_t target) const;

  /// The end of a search that the tip reaches only with the target as much farther off: the target is ignored.
  bool clear_past(const JointVector& from, const JointVector& to, std::size_t target) const;

  /// Corner at a way-point between two clear moves. Empty if the cell restricts moves, since the
  /// restriction applies to straight ones.
  Corner corner(const JointVector& from, const JointVector& at, const JointVector& to) const;

  /// The worst hit; for a move that at the first posture found to hit. Empty if the posture or move
  /// is clear.
  std::optional<Hit> hit(const JointVector& q) const;
  std::optional<Hit> hit(const JointVector& from, const JointVector& to) const;
  std::optional<Hit> hit_search(const JointVector& from, const JointVector& to,
                                std::size_t target) const;

 private:
  struct Impl;
  explicit Clearance(Hidden<Impl> impl);
  Hidden<Impl> impl_;  ///< null: blind
};

}  // namespace cellcal::calib
