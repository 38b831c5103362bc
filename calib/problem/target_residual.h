#pragma once
// What a touch says of its target, a type for each kind, (12) to (15). `own` are the unknowns of the
// target (target_place.h): where it stands, counted from `start`, and behind that the error of a
// sphere's radius, or how a tracker's probe is turned on the tool. Metres and radians, base frame;
// derivatives by SI unknowns.

#include <Eigen/Core>
#include <variant>

#include "calib/problem/target_place.h"

namespace cellcal::calib {

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
