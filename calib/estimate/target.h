#pragma once
// Place of a target and its unknowns. The unknowns of a
// - sphere, wire or point: its centre;
// - plane: the tangents of two tilts, and a shift along its normal;
// - tracker: position of the mean of its readings, and a rotation vector of its frame about that
//   point.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "calib/model/kinematics.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Start from which the unknowns count.
struct TargetPlace {
  TargetPlace() = default;
  TargetPlace(const Eigen::Vector3d& centre) : centre_m(centre) {}  // NOLINT: a centre is a place
  /// Base frame. Plane: a point on it. Tracker: position of `middle_m`.
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
  /// Plane: the third column is its normal, to the side of the tips. Tracker: its axes, in the base
  /// frame.
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();  ///< tracker: in its own frame
  /// Pose tracker: orientation of the probe's frame in the tool's.
  Eigen::Matrix3d probe = Eigen::Matrix3d::Identity();
};

/// Orientation of the probe in the tracker's frame, for a touch with `tracker_abc_rad`.
Eigen::Matrix3d probe_turn(const Touch& touch);

/// Number of unknowns of a target's place, without radius and probe rotation: 3, or 6 for a
/// tracker.
int place_size(TargetKind kind);

/// Values of the unknowns, counted from `start` [m, rad], of a target at `place`; a tracker's frame
/// by its effect on any reading. Inverse of result_at().
Eigen::VectorXd unknowns_at(TargetKind kind, const TargetPlace& start, const TargetPlace& place);

/// Distance of a tip from a plane with these unknowns, positive to the side of the normal. `normal`
/// and the derivative by the unknowns are optional.
double plane_distance_m(const TargetPlace& start, const double* unknowns,
                        const Eigen::Vector3d& tip_m, Eigen::Vector3d* normal,
                        Eigen::RowVector3d* by_unknowns);

/// Position of a tracker's reading in the base frame, by these unknowns.
Eigen::Vector3d tracked_m(const TargetPlace& start, const double* unknowns,
                          const Eigen::Vector3d& reading_m,
                          Eigen::Matrix<double, 3, 6>* by_unknowns);

/// Result of a target: centre, normal and distance, or frame.
TargetResult result_at(const Target& target, const TargetPlace& start, const double* unknowns);

/// True if the stated centre of the target is a prior with a sigma, not only a starting value.
bool centre_is_held(const Target& target);

/// Place of each target by its fit touches, seen with the nominal arm; default for targets without
/// any. Throws IdentifyError with target and remedy if they do not determine the place.
std::vector<TargetPlace> starting_places(const Cell& cell, const ArmModel& arm,
                                         const std::vector<Touch>& touches);

/// As starting_places(); nullopt if the touches of a target do not determine its place.
std::optional<std::vector<TargetPlace>> seen_places(const Cell& cell, const ArmModel& arm,
                                                    const std::vector<Touch>& touches);

/// As starting_places(), with approximate places, stated or touched, for undetermined targets.
std::vector<TargetPlace> rough_places(const Cell& cell, const ArmModel& arm,
                                      const std::vector<Touch>& touches);

/// Number of fit touches of a target, seen with the nominal arm, that are close enough together for
/// one target.
struct LieTogether {
  std::size_t most = 0, of = 0;
};
LieTogether lie_together(const Cell& cell, const ArmModel& arm, const std::string& target,
                         const std::vector<Touch>& touches);

/// Plane tangent to spheres of `tip_radius_m` about the tips, on the side of `start`; `start` if
/// the tips do not span a plane.
TargetPlace plane_through(const std::vector<Eigen::Vector3d>& tips_m, double tip_radius_m,
                          const TargetPlace& start);

// Residual of a touch, (12) to (15). `own` are the unknowns of the target: its
// place, counted from `start`, then the error of a sphere's radius, or the rotation of a tracker's
// probe on the tool. Metres and radians, base frame; derivatives by SI unknowns.

/// Unit vector along `offset`. At the centre itself any direction serves: the residual is -r_c and
/// its gradient is undefined.
Eigen::Vector3d direction_of(const Eigen::Vector3d& offset);

/// Distance of the tip from the target's reference, a centre or a plane.
struct Distance {
  double m = 0.0;
  Eigen::Vector3d normal;       ///< unit; the derivative by the tip
  Eigen::RowVector3d by_place;  ///< by the three unknowns of the place
};

/// Targets that measure a distance.
/// Sphere: |p - c| - (r_s + r_tip + rho + dr); plane: n.(p - c_0) - shift - (r_tip + rho); wire: |p - c| - L_w.
/// A late latch on a surface measures too deep.
struct DistanceResidual {
  TargetKind kind;
  double stated_m;      ///< r_s + r_tip, r_tip, or L_w
  bool has_own_radius;  ///< dr is the fourth of `own`
  bool has_surface() const { return kind != TargetKind::kWire; }
  Distance distance(const TargetPlace& start, const double* own, const Eigen::Vector3d& tip) const;
  double radius_m(double rho_m, const double* own) const;
};

/// Position of the tip measured by the target; the residual is the tip minus that.
struct SeenTip {
  Eigen::Vector3d m;
  Eigen::Matrix<double, 3, 6> by_place;  ///< its first columns are those of the place's unknowns
};

/// Targets that measure the position of the tip.
/// Point: p - c; tracker: p - Y(y), and with `has_turns` the rotation of the probe.
struct PositionResidual {
  TargetKind kind;
  bool has_turns;
  Eigen::Vector3d reading_m;  ///< in the tracker's frame
  Eigen::Matrix3d probe;      ///< the probe's frame in the tracker's, where it has turns
  SeenTip seen(const TargetPlace& start, const double* own, bool derivatives) const;
};

/// Rotation vector from the probe's orientation seen by the tracker to that by the arm, times a
/// lever.
struct ProbeTurn {
  Eigen::Vector3d m;
  /// Derivatives by a rotation of the tool about the base's axes, and by the unknowns of the
  /// frame's rotation and the mount's.
  Eigen::Matrix3d by_tool, by_frame, by_mount;
};
/// `tool`: orientation of the tool's frame in the base frame. `own`: nine unknowns.
ProbeTurn probe_turn(const PositionResidual& touch, const TargetPlace& start, const double* own,
                     const Eigen::Matrix3d& tool, double lever_m, bool derivatives);

using TargetResidual = std::variant<DistanceResidual, PositionResidual>;

/// `stated_radius_m`: r_s + r_tip of a sphere, r_tip of a plane. `has_turns`: uses the probe's
/// rotations of this target's touches where available.
TargetResidual residual_of(const Touch& touch, const Target& target, double stated_radius_m,
                           bool has_turns);

/// Number of residuals of a touch: 1, 3, or 6 with rotations.
int rows_of(const TargetResidual& residual);

}  // namespace cellcal::calib
