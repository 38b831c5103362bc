#pragma once
// Whether the arm hits nothing: spheres, their stands, obstacles, the floor, itself. Arm and tool
// are capsules on the nominal geometry (bodies.h). Not looked at: cables, and what the cell file
// does not name. Where it states no floor, hand and wrist stay above the lowest target less 0.1 m.
//
// Margins. The tip (slim end and ball) keeps what the caller says; all else 20 mm: an uncalibrated
// arm is off by up to 10 mm. Against itself the arm is looked at where links are no neighbours. Two
// bodies closer than their margin in more than half of all postures inside the limits are
// neighbours: their capsules overlap by construction.
//
// Moves are straight in joint space. From the posture at one end of a piece of the move every
// body's distance gap_0 is known, from the other end gap_1, both at least the margin M_c. No point of
// the body moves further along the piece than D_max, its levers times the turns of the joints.
// Half-way or anywhere else its distance is then at least (gap_0 + gap_1 - D_max) / 2. A piece is
// done when D_max <= gap_0 + gap_1 - 1.84 M_c, and halved otherwise: so on the whole move every body keeps at least 0.92 of its
// margin, and nothing, however thin, is passed unseen.
//
// Postures and moves that the cell says cannot be led through (Cell::passable) count as hits.

#include <memory>
#include <optional>
#include <string>

#include "calib/model/joint_vector.h"
#include "calib/model/kinematics.h"
#include "calib/plan/planned_touch.h"

namespace cellcal::calib {

// What keeps the arm from a posture or a move, and its sentence.

/// Where the cell file states no floor, hand and wrist stay above the lowest target less this.
inline constexpr double kBelowTargetsM = 0.10;

struct Hit {
  enum class Kind {
    kTooNear,       ///< the body comes nearer to the other thing than its margin
    kBelowTargets,  ///< the body goes too deep, where the cell file states no floor
    kImpassable     ///< of no body: near a singularity, or beyond a correction limit
  };
  Kind kind = Kind::kTooNear;
  std::string body = {};   ///< "the forearm (A4)"
  std::string other = {};  ///< kTooNear: "obstacle table"
  double gap_m = 0.0;      ///< kTooNear; 0 or less where they meet

  /// Of the same things, however near they come.
  bool is_like(const Hit& hit) const {
    return kind == hit.kind && body == hit.body && other == hit.other;
  }
};

/// "the forearm (A4) comes within 12 mm of obstacle table"
std::string words(const Hit& hit);
/// `otherwise` where nothing is hit.
std::string words_or(const std::optional<Hit>& hit, const char* otherwise);

// A way-point need not be visited. A triangle of postures is clear where its middle keeps gap and no
// body is moved by more than gap - 0.92 M_c from there to its corners (levers times turns are convex, so
// nowhere else either), or where the four triangles between its corners and the middles of its sides
// are. At a way-point the largest that is clear is looked for: between it and points on both legs.

/// Of every margin, on the whole of a move.
inline constexpr double kMarginKept = 0.92;

class Clearance {
 public:
  /// Targets must state their centres. Refers to `arm`. Throws PlanError where an obstacle's mesh
  /// was not read.
  Clearance(const Cell& cell, const ArmModel& arm);
  /// For which everything is clear: what could be reached if nothing stood in the way?
  static Clearance blind();
  Clearance(Clearance&&) noexcept;
  ~Clearance();

  /// `tip_margin_m`: how far the tip must stay from every surface.
  bool clear(const JointVector& q, double tip_margin_m) const;
  bool clear(const JointVector& from, const JointVector& to, double tip_margin_m) const;
  /// The search for target `target` (index into the cell): the tip may touch it and its stand, and
  /// the tool come as near to them as a touch brings it.
  bool clear_search(const JointVector& from, const JointVector& to, std::size_t target,
                    double tip_margin_m) const;

  /// Around a way-point between two moves that are clear. Nothing where the cell says which moves
  /// can be led: it speaks of straight ones.
  Corner corner(const JointVector& from, const JointVector& at, const JointVector& to,
                double tip_margin_m) const;

  /// The worst that is hit. Of a move: at the first posture that was found to hit. Empty where the
  /// posture or move is clear.
  std::optional<Hit> hit(const JointVector& q, double tip_margin_m) const;
  std::optional<Hit> hit(const JointVector& from, const JointVector& to, double tip_margin_m) const;
  std::optional<Hit> hit_search(const JointVector& from, const JointVector& to, std::size_t target,
                                double tip_margin_m) const;

 private:
  struct Impl;
  explicit Clearance(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;  ///< null: blind
};

}  // namespace cellcal::calib
