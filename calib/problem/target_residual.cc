#include "calib/problem/target_residual.h"

#include "calib/model/turn.h"

namespace cellcal::calib {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Place = Eigen::Map<const Vector3d>;

Distance from_centre(const double* centre, const Vector3d& tip) {
  const Vector3d offset = tip - Place(centre);
  const Vector3d normal = direction_of(offset);
  return {offset.norm(), normal, -normal.transpose()};
}

}  // namespace

Vector3d direction_of(const Vector3d& offset) {
  const double length = offset.norm();
  return length > 0.0 ? Vector3d(offset / length) : Vector3d::UnitZ();
}

Distance SphereResidual::distance(const TargetPlace&, const double* own,
                                  const Vector3d& tip) const {
  return from_centre(own, tip);
}

double SphereResidual::radius_m(double rho_m, const double* own) const {
  return has_own_radius ? stated_radius_m + rho_m + own[3] : stated_radius_m + rho_m;
}

Distance WireResidual::distance(const TargetPlace&, const double* own, const Vector3d& tip) const {
  return from_centre(own, tip);
}

Distance PlaneResidual::distance(const TargetPlace& start, const double* own,
                                 const Vector3d& tip) const {
  Distance distance;
  distance.m = plane_distance_m(start, own, tip, &distance.normal, &distance.by_place);
  return distance;
}

SeenTip PointResidual::seen(const TargetPlace&, const double* own, bool derivatives) const {
  SeenTip seen{Place(own), {}};
  if (derivatives) seen.by_place.leftCols<kPlace>().setIdentity();
  return seen;
}

SeenTip TrackerResidual::seen(const TargetPlace& start, const double* own, bool derivatives) const {
  SeenTip seen;
  seen.m = tracked_m(start, own, reading_m, derivatives ? &seen.by_place : nullptr);
  return seen;
}

ProbeTurn probe_turn(const TrackerResidual& touch, const TargetPlace& start, const double* own,
                     const Matrix3d& tool, double lever_m, bool derivatives) {
  const Place frame(own + 3), mount(own + 6);
  const Matrix3d held = tool * turn(mount) * start.probe;
  const Matrix3d seen = turn(frame) * start.axes * touch.probe;
  const Matrix3d apart = held * seen.transpose();
  const Vector3d off = turn_vector(apart);  // (15)
  ProbeTurn result;
  result.m = lever_m * off;
  if (!derivatives) return result;
  result.by_tool = lever_m * turn_vector_derivative(off);
  result.by_frame = -result.by_tool * apart * turn_derivative(frame);
  result.by_mount = result.by_tool * tool * turn_derivative(mount);
  return result;
}

TargetResidual residual_of(const Touch& touch, const Target& target, double stated_radius_m,
                           bool has_turns) {
  switch (target.kind) {
    case TargetKind::kSphere:
      return SphereResidual{stated_radius_m, target.diameter_sigma_m > 0.0};
    case TargetKind::kWire:
      return WireResidual{touch.radius_m};
    case TargetKind::kPlane:
      return PlaneResidual{stated_radius_m};
    case TargetKind::kPoint:
      return PointResidual{};
    case TargetKind::kTracker:
      break;
  }
  TrackerResidual tracker{has_turns && touch.tracker_abc_rad.has_value(), Place(touch.tracker_m),
                          Matrix3d::Identity()};
  if (tracker.has_turns) tracker.probe = probe_turn(touch);
  return tracker;
}

int rows_of(const TargetResidual& residual) {
  return std::visit(
      [](const auto& touch) {
        if constexpr (requires { touch.has_turns; })
          return touch.has_turns ? 6 : 3;
        else
          return 1;
      },
      residual);
}

}  // namespace cellcal::calib
