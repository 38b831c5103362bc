#pragma once
// Where a target stands and how its own unknowns move it from there. The unknowns of a
// - sphere, wire or point: its centre;
// - plane: the tangents of two tilts, and a shift along its normal;
// - tracker: where the middle of its readings lies, and a rotation vector by which its frame turns
//   about that.

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

/// A start, from which the unknowns count.
struct TargetPlace {
  TargetPlace() = default;
  TargetPlace(const Eigen::Vector3d& centre) : centre_m(centre) {}  // NOLINT: a centre is a place
  /// Base frame. Plane: a point on it. Tracker: where `middle_m` lies.
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
  /// Plane: the third column is its normal, to the side of the tips. Tracker: its axes, in the base
  /// frame.
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();  ///< tracker: in its own frame
  /// Tracker of poses: how the probe sits on the tool, the probe's frame in the tool's.
  Eigen::Matrix3d probe = Eigen::Matrix3d::Identity();
};

/// The probe's frame in the tracker's, of a touch that has its turns.
Eigen::Matrix3d probe_turn(const Touch& touch);

/// Unknowns of a target, a sphere's radius and how a probe sits aside: 3, or 6 for a tracker.
int place_size(TargetKind kind);

/// Values of the unknowns counted from `start` [m, rad] that put the target at `place`; a tracker's
/// frame by what it does to any reading. Inverse of result_at.
Eigen::VectorXd unknowns_at(TargetKind kind, const TargetPlace& start, const TargetPlace& place);

/// What a plane with these unknowns says about a tip: its distance from the plane, to the side of
/// the normal. `normal`, and the derivative by the unknowns, where wanted.
double plane_distance_m(const TargetPlace& start, const double* unknowns,
                        const Eigen::Vector3d& tip_m, Eigen::Vector3d* normal,
                        Eigen::RowVector3d* by_unknowns);

/// Where a tracker with these unknowns saw its reading, in the base frame.
Eigen::Vector3d tracked_m(const TargetPlace& start, const double* unknowns,
                          const Eigen::Vector3d& reading_m,
                          Eigen::Matrix<double, 3, 6>* by_unknowns);

/// Fills centre, normal and distance, or frame.
TargetResult result_at(const Target& target, const TargetPlace& start, const double* unknowns);

/// Whether the cell file holds the target's centre where it states it, and does not only begin
/// there.
bool centre_is_held(const Target& target);

/// Where each target is by its fit touches, seen with the nominal arm; of targets without any,
/// nothing. Throws IdentifyError naming the target and what to do where they do not say.
std::vector<TargetPlace> starting_places(const Cell& cell, const ArmModel& arm,
                                         const std::vector<Touch>& touches);

/// The same, and no places at all where those of one target do not say.
std::optional<std::vector<TargetPlace>> seen_places(const Cell& cell, const ArmModel& arm,
                                                    const std::vector<Touch>& touches);

/// The same where they say too little: of such a target where it is stated or touched, about.
std::vector<TargetPlace> rough_places(const Cell& cell, const ArmModel& arm,
                                      const std::vector<Touch>& touches);

/// Of a target's fit touches, seen with the nominal arm: how many lie no farther apart than one
/// target's do.
struct LieTogether {
  std::size_t most = 0, of = 0;
};
LieTogether lie_together(const Cell& cell, const ArmModel& arm, const std::string& target,
                         const std::vector<Touch>& touches);

/// A plane through these tips, whose ball of `tip_radius_m` touches it, to the side of `start`; as
/// `start` where they do not span one.
TargetPlace plane_through(const std::vector<Eigen::Vector3d>& tips_m, double tip_radius_m,
                          const TargetPlace& start);

// What a touch says of its target, a type for each kind, (12) to (15). `own` are the unknowns of the
// target (target_place.h): where it stands, counted from `start`, and behind that the error of a
// sphere's radius, or how a tracker's probe is turned on the tool. Metres and radians, base frame;
// derivatives by SI unknowns.

/// Unit. At the very centre every direction is as good; the residual is then -r_c and has no
/// gradient.
Eigen::Vector3d direction_of(const Eigen::Vector3d& offset);

/// From what a target is measured from, a centre or a plane, to the tip.
struct Distance {
  double m = 0.0;
  Eigen::Vector3d normal;       ///< unit; the derivative by the tip
  Eigen::RowVector3d by_place;  ///< by the three unknowns of the place
};

/// |p - c| - (r_s + r_tip + rho + dr). A late latch reads it too deep.
struct SphereResidual {
  static constexpr bool kHasSurface = true;
  double stated_radius_m;  ///< r_s + r_tip
  bool has_own_radius;     ///< dr is the fourth of `own`
  Distance distance(const TargetPlace& start, const double* own, const Eigen::Vector3d& tip) const;
  double radius_m(double rho_m, const double* own) const;
};

/// |p - c| - L_w
struct WireResidual {
  static constexpr bool kHasSurface = false;
  static constexpr bool has_own_radius = false;
  double length_m;
  Distance distance(const TargetPlace& start, const double* own, const Eigen::Vector3d& tip) const;
  double radius_m(double /*rho_m*/, const double* /*own*/) const { return length_m; }
};

/// n.(p - c_0) - shift - (r_tip + rho). A late latch reads it too deep.
struct PlaneResidual {
  static constexpr bool kHasSurface = true;
  static constexpr bool has_own_radius = false;
  double tip_radius_m;
  Distance distance(const TargetPlace& start, const double* own, const Eigen::Vector3d& tip) const;
  double radius_m(double rho_m, const double* /*own*/) const { return tip_radius_m + rho_m; }
};

/// Where a target says that the tip is; the residual is the tip minus that.
struct SeenTip {
  Eigen::Vector3d m;
  Eigen::Matrix<double, 3, 6> by_place;  ///< its first columns are those of the place's unknowns
};

/// p - c
struct PointResidual {
  static constexpr int kPlace = 3;
  static constexpr bool has_turns = false;
  SeenTip seen(const TargetPlace& start, const double* own, bool derivatives) const;
};

/// p - Y(y), and with `has_turns` the turn of the probe.
struct TrackerResidual {
  static constexpr int kPlace = 6;
  bool has_turns;
  Eigen::Vector3d reading_m;  ///< in the tracker's frame
  Eigen::Matrix3d probe;      ///< the probe's frame in the tracker's, where it has turns
  SeenTip seen(const TargetPlace& start, const double* own, bool derivatives) const;
};

/// The turn that leads from where a tracker saw the probe to where the arm has it, times a lever.
struct ProbeTurn {
  Eigen::Vector3d m;
  /// By a turn of the tool about the base's axes; by the unknowns of the frame's turn and the
  /// mount's.
  Eigen::Matrix3d by_tool, by_frame, by_mount;
};
/// `tool`: the tool's frame in the base's. `own`: nine.
ProbeTurn probe_turn(const TrackerResidual& touch, const TargetPlace& start, const double* own,
                     const Eigen::Matrix3d& tool, double lever_m, bool derivatives);

using TargetResidual =
    std::variant<SphereResidual, WireResidual, PlaneResidual, PointResidual, TrackerResidual>;

/// `stated_radius_m`: r_s + r_tip of a sphere, r_tip of a plane. `has_turns`: the probe's turns of
/// this target's touches are used where they were read.
TargetResidual residual_of(const Touch& touch, const Target& target, double stated_radius_m,
                           bool has_turns);

/// Residuals of a touch: 1, 3, or 6 with turns.
int rows_of(const TargetResidual& residual);

}  // namespace cellcal::calib
