#pragma once
// Touches that the arm can make: direction, tool orientation and arm configuration, with the joint
// angles of the whole search line.

#include <optional>
#include <string>
#include <vector>

#include "calib/model/random.h"
#include "calib/plan/clearance.h"
#include "calib/plan/planned_touch.h"

namespace cellcal::calib {

struct Candidate {
  std::size_t target = 0;  ///< index into the cell
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  JointVector contact;  ///< nominal
  JointVector standoff, end, clear;
  Eigen::Matrix3d orientation = Eigen::Matrix3d::Identity();  ///< of the TCP
  std::vector<JointVector> from_rest;  ///< clear way from the resting posture to the stand-off
  std::vector<JointVector> to_rest;    ///< and from the clear point back
};

enum class Kinds { kSpheres, kSpheresAndPlanes };

/// Whether touches of the target can be planned: of spheres, and of planes whose file says where
/// they are and how far about there they may be touched.
bool is_planned(const Target& target, Kinds kinds);
enum class NotPlanned {
  kPlaceUnknown,  ///< a plane without centre or normal
  kSizeUnknown,   ///< a plane without extent
  kSeated,        ///< a point: the tip has to be put into it by hand
  kHooked,        ///< a wire: by hand, too
  kMeasures       ///< a tracker, which is not touched
};
/// Why they cannot; nothing: they can.
std::optional<NotPlanned> why_not_planned(const Target& target);
/// Behind the target's id.
const char* words(NotPlanned why);

/// About `per_target` candidates for every such target, spread over the reachable directions of a
/// sphere or places of a plane, tool orientations and configurations of the arm. The same for the
/// same seed.
std::vector<Candidate> find_candidates(const Cell& cell, const ArmModel& arm,
                                       const Clearance& clearance, const PlanOptions& options,
                                       int per_target, Kinds kinds = Kinds::kSpheres);

/// Up to `count` touches like this one: its direction (its place, on a plane) and its tool
/// orientation turned by about `by_rad` in random directions, the arm in the same configuration.
/// Within the same cone, elevations, extents, limits and clearances as those of find_candidates.
std::vector<Candidate> vary(const Cell& cell, const ArmModel& arm, const Clearance& clearance,
                            const PlanOptions& options, const Candidate& like, int count,
                            double by_rad, Random& random);

/// Wrists that could turn further are kept within one turn: the cables thank for it.
inline constexpr double kWristRad = 3.0;
inline constexpr std::size_t kFirstWristJoint = 3;

/// Transits keep the nominal tip this far from every surface, and 0.92 of it, 10 mm, on the way.
/// Arms of twice the usual tolerances have been 9 mm off.
inline constexpr double kTipMarginM = 0.011;

// Why a sphere cannot be touched, in words for a person. Slow; asked only where a plan is refused.

/// "(0.10, 0.20, 0.97)"
std::string direction_words(const Eigen::Vector3d& normal);

/// Touches of the sphere that the joint limits allow are looked for as if nothing stood in the way;
/// then what hinders most of them: "from direction (..) the forearm (A4) comes within 12 mm of
/// obstacle table". Nothing where the limits allow none.
std::optional<std::string> hindrance(const Cell& cell, const ArmModel& arm,
                                     const Clearance& clearance, const PlanOptions& options,
                                     std::size_t target);

/// Whether the whole line of a touch is clear, from the clear point to the end of the search.
bool clear_line(const Clearance& clearance, const Candidate& candidate);

}  // namespace cellcal::calib
