#pragma once
// Feasible touches: direction, tool orientation and arm configuration, with the joint angles of the
// whole search line.

#include <optional>
#include <string>
#include <vector>

#include "calib/model/linear.h"
#include "calib/plan/clearance.h"
#include "calib/plan/planned_touch.h"

namespace cellcal::calib {

struct Candidate {
  std::size_t target = 0;  ///< index into the cell
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  JointVector contact;  ///< nominal
  JointVector standoff, end, clear;
  JointVector within;  ///< on the search line, SearchReach::within_m behind the surface
  Eigen::Matrix3d orientation = Eigen::Matrix3d::Identity();  ///< of the TCP
  std::vector<double> positioner_rad;  ///< where its axes stand; empty without one
  std::vector<JointVector> from_rest;  ///< clear path from the resting posture to the stand-off
  std::vector<JointVector> to_rest;    ///< clear path from the clear point back
};

/// One per candidate, in order.
std::vector<Touch> touches_of(const Cell& cell, const std::vector<Candidate>& candidates);

enum class Kinds { kSpheres, kSpheresAndPlanes };

/// True if touches of the target can be planned: spheres, and planes with stated position and
/// extent.
bool is_planned(const Target& target, Kinds kinds);
enum class NotPlanned {
  kPlaceUnknown,  ///< a plane without centre or normal
  kSizeUnknown,   ///< a plane without extent
  kSeated,        ///< a point: the tip is inserted by hand
  kHooked,        ///< a wire: attached by hand
  kMeasures       ///< a tracker: not touched
};
/// Reason why the target's touches cannot be planned; empty if they can.
std::optional<NotPlanned> why_not_planned(const Target& target);
/// Phrase that follows the target's id.
const char* words(NotPlanned why);

/// About `per_target` candidates for every such target, distributed over the reachable directions
/// of a sphere or places of a plane, tool orientations and configurations of the arm. Deterministic
/// for a seed.
std::vector<Candidate> find_candidates(const Cell& cell, const ArmModel& arm,
                                       const Clearance& clearance, const PlanOptions& options,
                                       int per_target, Kinds kinds = Kinds::kSpheres);

/// Up to `count` touches similar to this one: direction (place, on a plane) and tool orientation
/// turned by about `by_rad` in random directions, the arm in the same configuration. Same cone,
/// elevations, extents, limits and clearances as find_candidates().
std::vector<Candidate> vary(const Cell& cell, const ArmModel& arm, const Clearance& clearance,
                            const PlanOptions& options, const Candidate& like, int count,
                            double by_rad, Random& random);

/// Wrists with a larger range are kept within one turn, to spare the cables.
inline constexpr double kWristRad = 3.0;
inline std::size_t first_wrist_joint(const Robot& robot) { return robot.first_turning() + 3; }

// Explains why a sphere cannot be touched. Slow; used only if a plan is refused.

/// "(0.10, 0.20, 0.97)"
std::string direction_words(const Eigen::Vector3d& normal);

struct Hindrance {
  Hit hit;
  Eigen::Vector3d from;  ///< direction of a touch that it blocks
};
/// Generates touches of the sphere within the joint limits as if there were no obstacles, and
/// returns what blocks most of them. Empty if the limits allow none.
std::optional<Hindrance> hindrance(const Cell& cell, const ArmModel& arm,
                                   const Clearance& clearance, const PlanOptions& options,
                                   std::size_t target);

/// True if the whole line of a touch is clear, from the clear point to the end of the search.
bool clear_line(const Clearance& clearance, const Candidate& candidate);

}  // namespace cellcal::calib
