#include "calib/estimate/target.h"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "calib/estimate/start.h"
#include "calib/model/error.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Largest deviation of the stated normal; beyond it the plane or the frame is another.
constexpr double kNormalCosine = 0.866;  // 30 deg
/// Smallest mean sine of the angle between tool and plane for which the tool's side is determined.
constexpr double kClearSide = 0.05;

/// Orthonormal axes: two directions normal to the unit vector n, and n.
Matrix3d axes_about(const Vector3d& n) {
  Matrix3d axes;
  axes.col(0) = n.unitOrthogonal();
  axes.col(1) = n.cross(axes.col(0));
  axes.col(2) = n;
  return axes;
}

/// Fit touches of one target, seen with the nominal arm.
struct Seen {
  std::vector<Vector3d> tips_m, readings_m;
  std::vector<Vector3d> tool;  ///< from the tip to the flange, unit
  std::vector<double> radii_m;
  std::vector<double> tip_radii_m;    ///< of the touches' tools
  std::vector<Matrix3d> tool_turns;   ///< of the tool's frame, for touches with probe_turns
  std::vector<Matrix3d> probe_turns;  ///< in the tracker's frame; of the same touches
};

Seen see(const ArmModel& arm, const Target& target, const std::vector<Touch>& touches) {
  Seen seen;
  for (const Touch& touch : touches) {
    if (touch.target != target.id || touch.set != TouchSet::kFit) continue;
    const int index = arm.tool_index(touch.tool);
    const Tool& tool = arm.tool(index);
    const Eigen::Isometry3d tcp =
        arm.nominal_tcp(touch.joint_rad, index, carrier_rad(touch, target));
    seen.tips_m.push_back(tcp.translation());
    seen.readings_m.emplace_back(touch.tracker_m[0], touch.tracker_m[1], touch.tracker_m[2]);
    seen.radii_m.push_back(target.kind == TargetKind::kWire
                               ? touch.radius_m
                               : target.diameter_m / 2.0 + tool.tip_radius_m);
    seen.tip_radii_m.push_back(tool.tip_radius_m);
    if (touch.tracker_abc_rad) {
      seen.tool_turns.push_back(tcp.linear());
      seen.probe_turns.push_back(probe_turn(touch));
    }
    seen.tool.push_back(
        ((tcp * tool.tcp.inverse()).translation() - tcp.translation()).stableNormalized());
  }
  return seen;
}

template <typename T>
std::vector<T> at(const std::vector<T>& all, const std::vector<std::size_t>& which) {
  std::vector<T> some;
  for (const std::size_t i : which) some.push_back(all[i]);
  return some;
}

/// Touches that are no farther apart than the target's size plus the worst error of a nominal arm;
/// all of them for a plane, which has no size.
std::vector<std::size_t> together(const Target& target, const Seen& seen) {
  constexpr double kNominalApartM = 30e-3;
  return of_one_target(seen.tips_m.size(), [&](std::size_t a, std::size_t b) {
    const double apart = (seen.tips_m[a] - seen.tips_m[b]).norm();
    double least = 0.0, most = std::numeric_limits<double>::infinity();
    if (target.kind == TargetKind::kTracker) {
      least = most = (seen.readings_m[a] - seen.readings_m[b]).norm();
    } else if (target.kind == TargetKind::kPoint) {
      most = 0.0;
    } else if (target.kind != TargetKind::kPlane) {
      most = seen.radii_m[a] + seen.radii_m[b];
      if (target.kind == TargetKind::kWire) least = std::abs(seen.radii_m[a] - seen.radii_m[b]);
    }
    // Non-finite values pass; the fits reject them.
    return !(apart < least - kNominalApartM) && !(apart > most + kNominalApartM);
  });
}

/// Touches without those too far from the others; all of them if no more than half are close
/// together, since this exceeds a few wrong labels.
Seen without_strays(const Target& target, const Seen& seen) {
  const std::vector<std::size_t> which = together(target, seen);
  if (2 * which.size() <= seen.tips_m.size()) return seen;
  return {at(seen.tips_m, which),  at(seen.readings_m, which),  at(seen.tool, which),
          at(seen.radii_m, which), at(seen.tip_radii_m, which), seen.tool_turns,
          seen.probe_turns};
}

/// Tip radius of the touches' tools; the mean if they differ.
double common_tip_radius_m(const Seen& seen) {
  const std::vector<double>& all = seen.tip_radii_m;
  if (std::all_of(all.begin(), all.end(), [&](double r) { return r == all.front(); }))
    return all.empty() ? 0.0 : all.front();
  return std::accumulate(all.begin(), all.end(), 0.0) / static_cast<double>(all.size());
}

/// Sign of the normal towards the tool, by the mean direction from tip to flange. nullopt if the
/// tool lies nearly along the plane and the side matters.
std::optional<double> side_of(const Cell& cell, const Seen& seen, const Vector3d& normal) {
  double mean = 0.0;
  for (const Vector3d& tool : seen.tool)
    mean += normal.dot(tool) / static_cast<double>(seen.tool.size());
  // A tip of radius zero touches the same plane from either side.
  const bool any_side = common_tip_radius_m(seen) == 0.0 && cell.radius_offset_sigma_m == 0.0;
  if (std::abs(mean) > kClearSide || any_side) return mean < 0.0 ? -1.0 : 1.0;
  return std::nullopt;
}

TargetPlace place_plane(const Cell& cell, const Target& target, const Seen& seen) {
  const PlaneFit fit = fit_plane(seen.tips_m);
  if (!fit.determined && !target.has_normal)
    throw IdentifyError(
        IdentifyError::Kind::kUndetermined, target.id,
        fmt::format(
            "target {}: {} fit touches do not span a plane. Touch it farther apart in two directions, "
            "or add its normal to the cell file",
            target.id, seen.tips_m.size()));
  Vector3d normal = fit.normal;
  if (target.has_normal) {
    if (normal.dot(target.normal) < 0.0) normal = -normal;
    if (!fit.determined) normal = target.normal;
    if (normal.dot(target.normal) < kNormalCosine)
      throw IdentifyError(
          IdentifyError::Kind::kCell, target.id,
          fmt::format(
              "target {}: normal of the touched plane {:.0f} deg off the stated one. Check its normal "
              "in the cell file",
              target.id, std::acos(std::clamp(normal.dot(target.normal), -1.0, 1.0)) * kDegPerRad));
  } else if (const auto side = side_of(cell, seen, normal)) {
    normal *= *side;
  } else {
    throw IdentifyError(
        IdentifyError::Kind::kUndetermined, target.id,
        fmt::format(
            "target {}: the touched side of the plane is not determined: the tool lies along "
            "it. Add its normal to the cell file, pointing to the side of the tool",
            target.id));
  }
  TargetPlace place(fit.middle_m - common_tip_radius_m(seen) * normal);
  place.axes = axes_about(normal);
  return place;
}

/// Orientation of the probe on the tool for the given tracker axes: mean over all touches.
Matrix3d probe_on_tool(const Matrix3d& axes, const Seen& seen) {
  Matrix3d sum = Matrix3d::Zero();
  for (std::size_t i = 0; i < seen.tool_turns.size(); ++i)
    sum += seen.tool_turns[i].transpose() * axes * seen.probe_turns[i];
  if (sum.isZero(0.0) || !sum.allFinite()) return Matrix3d::Identity();
  const Eigen::JacobiSVD<Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Matrix3d proper = Matrix3d::Identity();
  proper(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  return svd.matrixU() * proper * svd.matrixV().transpose();
}

TargetPlace place_tracker(const Target& target, const Seen& seen) {
  for (const Vector3d& reading : seen.readings_m)
    if (!reading.allFinite())
      throw IdentifyError(
          IdentifyError::Kind::kTouches, target.id,
          fmt::format("target {}: a reading is not a number. Leave it out", target.id));
  const FrameFit fit = fit_frame(seen.readings_m, seen.tips_m);
  if (!fit.determined)
    throw IdentifyError(
        IdentifyError::Kind::kUndetermined, target.id,
        fmt::format(
            "target {}: {} fit touches whose readings lie in a line do not determine the tracker's "
            "frame. Measure at three places or more that are not in a line",
            target.id, seen.readings_m.size()));
  TargetPlace place(fit.frame * fit.middle_m);
  place.axes = fit.frame.linear();
  place.middle_m = fit.middle_m;
  place.probe = probe_on_tool(place.axes, seen);
  return place;
}

/// Throws IdentifyError with the remedy if the touches do not determine the place.
TargetPlace place_of(const Cell& cell, const Target& target, const Seen& seen) {
  if (target.kind == TargetKind::kPlane) return place_plane(cell, target, seen);
  if (target.kind == TargetKind::kTracker) return place_tracker(target, seen);
  if (target.kind == TargetKind::kPoint) return TargetPlace(mean_of_points(seen.tips_m));
  CentreHints hints{target.has_centre ? &target.centre_m : nullptr, target.centre_sigma_m};
  if (target.kind == TargetKind::kSphere)
    for (const Vector3d& tool : seen.tool) hints.outwards += tool;
  const SphereFit fit = fit_centre(seen.tips_m, seen.radii_m, hints);
  if (!fit.determined && !target.has_centre)
    throw IdentifyError(
        IdentifyError::Kind::kUndetermined, target.id,
        fmt::format(
            "target {}: {} fit touches do not span a sphere. Touch it from more sides, or add "
            "centre_mm to the cell file",
            target.id, seen.tips_m.size()));
  return TargetPlace(fit.centre_m);
}

using Place = Eigen::Map<const Vector3d>;

}  // namespace

Matrix3d probe_turn(const Touch& touch) {
  FrameMmDeg frame;
  for (std::size_t k = 0; k < 3; ++k) frame.abc_deg[k] = (*touch.tracker_abc_rad)[k] * kDegPerRad;
  return to_isometry(frame).linear();
}

int place_size(TargetKind kind) { return kind == TargetKind::kTracker ? 6 : 3; }

Eigen::VectorXd unknowns_at(TargetKind kind, const TargetPlace& start, const TargetPlace& place) {
  if (kind == TargetKind::kPlane) {
    const Vector3d n = start.axes.transpose() * place.axes.col(2);
    return Vector3d(n.x() / n.z(), n.y() / n.z(),
                    place.axes.col(2).dot(place.centre_m - start.centre_m));
  }
  if (kind == TargetKind::kTracker) {
    Eigen::VectorXd x(6);
    x << place.centre_m + place.axes * (start.middle_m - place.middle_m),
        turn_vector(place.axes * start.axes.transpose());
    return x;
  }
  return place.centre_m;
}

double plane_distance_m(const TargetPlace& start, const double* unknowns, const Vector3d& tip_m,
                        Vector3d* normal, Eigen::RowVector3d* by_unknowns) {
  const Vector3d sum =
      start.axes.col(2) + unknowns[0] * start.axes.col(0) + unknowns[1] * start.axes.col(1);
  const double length = sum.norm();                               // 1 or more
  const Vector3d n = sum / length, arm = tip_m - start.centre_m;  // (13)
  if (normal != nullptr) *normal = n;
  const double height = n.dot(arm);
  if (by_unknowns != nullptr) {
    const Vector3d across = (arm - height * n) / length;
    *by_unknowns << across.dot(start.axes.col(0)), across.dot(start.axes.col(1)), -1.0;
  }
  return height - unknowns[2];
}

Vector3d tracked_m(const TargetPlace& start, const double* unknowns, const Vector3d& reading_m,
                   Eigen::Matrix<double, 3, 6>* by_unknowns) {
  const Eigen::Map<const Vector3d> centre(unknowns), w(unknowns + 3);
  const Vector3d turned = turn(w) * (start.axes * (reading_m - start.middle_m));  // (14)
  if (by_unknowns != nullptr) {
    by_unknowns->leftCols<3>().setIdentity();
    by_unknowns->rightCols<3>() = -cross_matrix(turned) * turn_derivative(w);
  }
  return centre + turned;
}

TargetResult result_at(const Target& target, const TargetPlace& start, const double* unknowns) {
  TargetResult result;
  result.id = target.id;
  result.kind = target.kind;
  if (target.kind == TargetKind::kPlane) {
    const double below = plane_distance_m(start, unknowns, start.centre_m, &result.normal, nullptr);
    result.centre_m = start.centre_m - below * result.normal;
    result.distance_m = result.normal.dot(result.centre_m);
    return result;
  }
  result.centre_m = Eigen::Map<const Vector3d>(unknowns);
  if (target.kind == TargetKind::kTracker) {
    result.frame.linear() = turn(Eigen::Map<const Vector3d>(unknowns + 3)) * start.axes;
    result.frame.translation() = result.centre_m - result.frame.linear() * start.middle_m;
  }
  return result;
}

bool centre_is_held(const Target& target) {
  return has_a_centre(target.kind) && target.has_centre && target.centre_sigma_m > 0.0;
}

std::vector<TargetPlace> starting_places(const Cell& cell, const ArmModel& arm,
                                         const std::vector<Touch>& touches) {
  std::vector<TargetPlace> places(cell.targets.size());
  for (std::size_t t = 0; t < cell.targets.size(); ++t) {
    const Target& target = cell.targets[t];
    const Seen seen = without_strays(target, see(arm, target, touches));
    if (!seen.tips_m.empty()) places[t] = place_of(cell, target, seen);
  }
  return places;
}

std::optional<std::vector<TargetPlace>> seen_places(const Cell& cell, const ArmModel& arm,
                                                    const std::vector<Touch>& touches) {
  try {
    return starting_places(cell, arm, touches);
  } catch (const IdentifyError&) {
    return std::nullopt;
  }
}

std::vector<TargetPlace> rough_places(const Cell& cell, const ArmModel& arm,
                                      const std::vector<Touch>& touches) {
  std::vector<TargetPlace> places(cell.targets.size());
  for (std::size_t t = 0; t < cell.targets.size(); ++t) {
    const Target& target = cell.targets[t];
    const Seen seen = see(arm, target, touches);
    if (seen.tips_m.empty()) continue;
    try {
      places[t] = place_of(cell, target, seen);
      continue;
    } catch (const IdentifyError&) {
      // Undetermined: approximately, below.
    }
    places[t].centre_m = mean_of_points(seen.tips_m);
    places[t].middle_m = mean_of_points(seen.readings_m);
    if (target.kind == TargetKind::kPlane) {
      Vector3d normal = target.has_normal ? target.normal : fit_plane(seen.tips_m).normal;
      if (!target.has_normal && normal.dot(mean_of_points(seen.tool)) < 0.0) normal = -normal;
      places[t].axes = axes_about(normal);
      places[t].centre_m -= common_tip_radius_m(seen) * normal;
    } else if (target.has_centre) {
      places[t].centre_m = target.centre_m;
    }
  }
  return places;
}

LieTogether lie_together(const Cell& cell, const ArmModel& arm, const std::string& target,
                         const std::vector<Touch>& touches) {
  const Target& its = cell.targets[cell.target_index(target)];
  const Seen seen = see(arm, its, touches);
  return {together(its, seen).size(), seen.tips_m.size()};
}

TargetPlace plane_through(const std::vector<Vector3d>& tips_m, double tip_radius_m,
                          const TargetPlace& start) {
  const PlaneFit fit = fit_plane(tips_m);
  TargetPlace place = start;
  if (fit.determined && std::abs(fit.normal.dot(start.axes.col(2))) > 0.5)
    place.axes = axes_about(fit.normal.dot(start.axes.col(2)) < 0.0 ? -fit.normal : fit.normal);
  if (!tips_m.empty()) place.centre_m = fit.middle_m - tip_radius_m * place.axes.col(2);
  return place;
}

Vector3d direction_of(const Vector3d& offset) {
  const double length = offset.norm();
  return length > 0.0 ? Vector3d(offset / length) : Vector3d::UnitZ();
}

Distance DistanceResidual::distance(const TargetPlace& start, const double* own,
                                    const Vector3d& tip) const {
  if (kind != TargetKind::kPlane) {
    const Vector3d offset = tip - Place(own);
    const Vector3d normal = direction_of(offset);
    return {offset.norm(), normal, -normal.transpose()};
  }
  Distance distance;
  distance.m = plane_distance_m(start, own, tip, &distance.normal, &distance.by_place);
  return distance;
}

double DistanceResidual::radius_m(double rho_m, const double* own) const {
  const double radius_m = has_surface() ? stated_m + rho_m : stated_m;
  return has_own_radius ? radius_m + own[3] : radius_m;
}

SeenTip PositionResidual::seen(const TargetPlace& start, const double* own,
                               bool derivatives) const {
  SeenTip seen{Place(own), {}};
  if (kind == TargetKind::kTracker)
    seen.m = tracked_m(start, own, reading_m, derivatives ? &seen.by_place : nullptr);
  else if (derivatives)
    seen.by_place.leftCols<3>().setIdentity();
  return seen;
}

ProbeTurn probe_turn(const PositionResidual& touch, const TargetPlace& start, const double* own,
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
  if (target.kind == TargetKind::kWire) return DistanceResidual{target.kind, touch.radius_m, false};
  if (target.kind == TargetKind::kSphere || target.kind == TargetKind::kPlane)
    return DistanceResidual{target.kind, stated_radius_m,
                            target.kind == TargetKind::kSphere && target.diameter_sigma_m > 0.0};
  PositionResidual position{target.kind, has_turns && touch.tracker_abc_rad.has_value(),
                            Place(touch.tracker_m), Matrix3d::Identity()};
  if (position.has_turns) position.probe = probe_turn(touch);
  return position;
}

int rows_of(const TargetResidual& residual) {
  const auto* position = std::get_if<PositionResidual>(&residual);
  return position == nullptr ? 1 : position->has_turns ? 6 : 3;
}

}  // namespace cellcal::calib
