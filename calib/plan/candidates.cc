#include "calib/plan/candidates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/model/enum_table.h"
#include "calib/model/inverse.h"
#include "calib/model/long_work.h"
#include "calib/plan/track.h"

namespace cellcal::calib {

namespace {

using Eigen::Vector3d;

/// Minimum elevation of the touch normal; the stand is below.
constexpr double kLowestElevationRad = -0.35;
/// Maximum angle of the tool axis to the inward normal. Wider cones separate the wrist's errors
/// better, but bring the tool's shaft close to the sphere.
constexpr double kConeRad = 0.70;
constexpr int kOrientations = 10;  // tries per direction
/// Maximum number of orientations and configurations per direction.
constexpr int kPerDirection = 2;

constexpr double kGoldenRad = std::numbers::pi * 0.7639320225002102;  // pi (3 - sqrt 5)

/// Point `i` of `n` of a Fibonacci lattice on the sphere, z along `up`.
Vector3d lattice(int i, int n, double shift) {
  const double z = 1.0 - 2.0 * (i + 0.5) / n;
  const double r = std::sqrt(1.0 - z * z);
  return {r * std::cos(kGoldenRad * i + shift), r * std::sin(kGoldenRad * i + shift), z};
}

/// Contact of a touch with its target: the tip is at `from` + `radius_m` `normal`.
struct Spot {
  Vector3d from, normal;
  double radius_m;
};

/// Point `i` of `n` of Vogel's spiral, which covers the plane's circle uniformly.
Spot spot_on_plane(const Target& plane, const Tool& tool, int i, int n, double shift) {
  const Vector3d across = plane.normal.unitOrthogonal();
  const double r = plane.extent_m / 2.0 * std::sqrt((i + 0.5) / n);
  return {plane.centre_m + r * (std::cos(kGoldenRad * i + shift) * across +
                                std::sin(kGoldenRad * i + shift) * plane.normal.cross(across)),
          plane.normal, tool.tip_radius_m};
}

/// Arguments of all trials of a touch.
struct Trying {
  const ArmModel& arm;
  const Clearance& clearance;
  const PlanOptions& options;
  const Target& target;
  const TrackOff& unit;
};

/// The complete search line of a touch that starts in the given posture.
std::optional<Candidate> try_touch(const Trying& with, const Spot& spot,
                                   const Eigen::Matrix3d& orientation, const JointVector& contact) {
  const auto& [arm, clearance, options, target, unit] = with;
  const auto pose_at = [&](double outside) {
    Eigen::Isometry3d pose(orientation);
    pose.translation() = spot.from + (spot.radius_m + outside) * spot.normal;
    return pose;
  };
  for (std::size_t i = first_wrist_joint(arm.robot()); i < contact.size(); ++i)
    if (std::abs(contact[i]) > kWristRad) return std::nullopt;
  const auto [before_m, behind_m, clear_m, within_m] = search_reach(unit, target, contact, options);
  const auto standoff = inverse(arm, pose_at(before_m), contact, options.limit_margin_rad);
  const auto end = inverse(arm, pose_at(-behind_m), contact, options.limit_margin_rad);
  const auto away = inverse(arm, pose_at(clear_m), contact, options.limit_margin_rad);
  if (!standoff || !end || !away) return std::nullopt;
  // The line must be one smooth motion: a change of configuration appears as a large joint step.
  constexpr double kLargestRad = 0.2;
  const double longer = (clear_m + behind_m) / (clear_m + within_m);
  for (std::size_t i = 0; i < contact.size(); ++i)
    if (std::abs((*end)[i] - (*away)[i]) > kLargestRad * longer) return std::nullopt;
  if (!clearance.clear(*standoff) || !clearance.clear(*away)) return std::nullopt;
  Candidate c;
  c.normal = spot.normal;
  c.contact = contact;
  c.standoff = *standoff;
  c.end = *end;
  c.clear = *away;
  c.within = behind_m > within_m
                 ? interpolated(*away, *end, (clear_m + within_m) / (clear_m + behind_m))
                 : *end;
  c.orientation = orientation;
  return c;
}

double contact_radius_m(const Target& target, const Tool& tool) {
  return target.diameter_m / 2.0 + tool.tip_radius_m;
}

bool above_the_stand(const Vector3d& normal, const Vector3d& up) {
  return std::asin(std::clamp(normal.dot(up), -1.0, 1.0)) >= kLowestElevationRad;
}

/// The posture with a linear unit moved by the arm's usual lever times `by_rad`, rms.
JointVector moved_along(const Robot& robot, JointVector q, double by_rad, Random& random) {
  constexpr double kLeverM = 0.5;
  if (robot.first_turning() == 0) return q;
  const Joint& track = robot.joints[0];
  q[0] = std::clamp(q[0] + kLeverM * by_rad * random.normal(), track.min_rad, track.max_rad);
  return q;
}

/// Rotation about a random axis by an angle of this rms.
Eigen::AngleAxisd turn_of(double rms_rad, Random& random) {
  Vector3d turn;
  for (double& component : turn) component = rms_rad / std::sqrt(3.0) * random.normal();
  const double angle = turn.norm();
  return {angle, angle > 0.0 ? Vector3d(turn / angle) : Vector3d::UnitX()};
}

constexpr int kTriedAlone = 40;

std::optional<Hit> first_collision(const Clearance& clearance, const Candidate& c) {
  for (const JointVector* q : {&c.standoff, &c.clear})
    if (auto hit = clearance.hit(*q)) return hit;
  return clearance.hit_search(c.clear, c.within, c.target);
}

}  // namespace

std::optional<NotPlanned> why_not_planned(const Target& target) {
  switch (target.kind) {
    case TargetKind::kSphere: break;
    case TargetKind::kPlane:
      if (!target.has_centre || !target.has_normal) return NotPlanned::kPlaceUnknown;
      if (!(target.extent_m > 0.0)) return NotPlanned::kSizeUnknown;
      break;
    case TargetKind::kPoint: return NotPlanned::kSeated;
    case TargetKind::kWire: return NotPlanned::kHooked;
    case TargetKind::kTracker: return NotPlanned::kMeasures;
  }
  return std::nullopt;
}

const char* words(NotPlanned why) {
  using enum NotPlanned;
  static constexpr EnumNames<NotPlanned> kTable{
      {{kPlaceUnknown, "a plane without centre_mm and normal: its place is unknown"},
       {kSizeUnknown, "a plane without extent_mm: its size is unknown"},
       {kSeated, "the tip has to be seated in a point by hand"},
       {kHooked, "a wire is hooked to the tool by hand"},
       {kMeasures, "a tracker measures by itself"}}};
  return kTable[why];
}

std::vector<Touch> touches_of(const Cell& cell, const std::vector<Candidate>& candidates) {
  std::vector<Touch> touches;
  for (const Candidate& candidate : candidates) {
    touches.emplace_back();
    touches.back().joint_rad = candidate.contact;
    touches.back().positioner_rad = candidate.positioner_rad;
    touches.back().target = cell.targets[candidate.target].id;
  }
  return touches;
}

bool is_planned(const Target& target, Kinds kinds) {
  return !target.obstacle_only &&
         (target.kind == TargetKind::kSphere || kinds == Kinds::kSpheresAndPlanes) &&
         !why_not_planned(target);
}

std::vector<Candidate> find_candidates(const Cell& cell, const ArmModel& arm,
                                       const Clearance& clearance, const PlanOptions& options,
                                       int per_target, Kinds kinds) {
  std::vector<Candidate> result;
  Random random(options.seed);
  const Configurations configurations(arm, options.limit_margin_rad);
  const TrackOff unit(cell.robot);
  const Vector3d shaft = shaft_of(cell.tool);
  const Eigen::Matrix3d tool = cell.tool.tcp.linear();
  for (std::size_t t = 0; t < cell.targets.size(); ++t) {
    const Target& target = cell.targets[t];
    if (!is_planned(target, kinds)) continue;
    const Vector3d up = stand_up(cell.robot, target);
    const Eigen::Quaterniond to_up = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), up);
    const Trying with{arm, clearance, options, target, unit};
    const bool plane = target.kind == TargetKind::kPlane;
    const double radius = contact_radius_m(target, cell.tool);
    const int directions = 2 * per_target;
    for (int i = 0, found = 0; i < directions && found < per_target; ++i) {
      poll_cancelled();
      report_progress((static_cast<double>(t) + static_cast<double>(i) / directions) /
                      static_cast<double>(cell.targets.size()));
      // Widely spaced lattice points first, so that a short list still surrounds the sphere.
      const int k = (i * 7919) % directions;
      const double shift = random.uniform(0.0, 0.1);
      const Spot spot = plane
                            ? spot_on_plane(target, cell.tool, k, directions, shift)
                            : Spot{target.centre_m, to_up * lattice(k, directions, shift), radius};
      const Vector3d& normal = spot.normal;
      if (!plane && !above_the_stand(normal, up)) continue;
      int own = 0;
      for (int attempt = 0; attempt < kOrientations && own < kPerDirection; ++attempt) {
        // Flange orientation: shaft along -normal, tilted within the cone, rotated about itself.
        const Eigen::AngleAxisd roll(random.uniform(-std::numbers::pi, std::numbers::pi), -normal);
        const Vector3d across = normal.unitOrthogonal();
        const Eigen::AngleAxisd heading(random.uniform(-std::numbers::pi, std::numbers::pi),
                                        normal);
        const Eigen::AngleAxisd tilt(kConeRad * std::sqrt(random.uniform()), heading * across);
        const Eigen::Matrix3d flange =
            (tilt * roll).toRotationMatrix() *
            Eigen::Quaterniond::FromTwoVectors(shaft, -normal).toRotationMatrix();
        Eigen::Isometry3d pose(flange * tool);
        pose.translation() = spot.from + spot.radius_m * normal;
        // A random configuration, and another one if the first is not clear.
        std::vector<JointVector> ways = configurations.reach(
            pose, track_position_m(arm, target.centre_m, options.limit_margin_rad, random));
        for (std::size_t left = ways.size(); left > 0; --left) {
          std::swap(ways[random.below(left)], ways[left - 1]);
          auto candidate = try_touch(with, spot, pose.linear(), ways[left - 1]);
          if (!candidate) continue;
          candidate->target = t;
          result.push_back(std::move(*candidate));
          ++own;
          ++found;
          break;
        }
      }
    }
  }
  return result;
}

std::vector<Candidate> vary(const Cell& cell, const ArmModel& arm, const Clearance& clearance,
                            const PlanOptions& options, const Candidate& like, int count,
                            double by_rad, Random& random) {
  const Target& target = cell.targets[like.target];
  const bool plane = target.kind == TargetKind::kPlane;
  const Vector3d up = stand_up(cell.robot, target);
  const Vector3d shaft = cell.tool.tcp.linear().transpose() * shaft_of(cell.tool);  // TCP's frame
  const double cone = std::cos(kConeRad);
  const TrackOff unit(cell.robot);
  const Trying with{arm, clearance, options, target, unit};
  std::vector<Candidate> result;
  for (int k = 0; k < count; ++k) {
    Spot spot{target.centre_m, like.normal, contact_radius_m(target, cell.tool)};
    const Eigen::AngleAxisd across = turn_of(by_rad, random);
    if (plane) {
      spot.radius_m = cell.tool.tip_radius_m;
      const Vector3d step = by_rad * target.extent_m / 2.0 * across.axis().cross(like.normal);
      spot.from = arm.nominal_tip_m(like.contact) - spot.radius_m * like.normal + step;
      if ((spot.from - target.centre_m).norm() > target.extent_m / 2.0) continue;
    } else {
      spot.normal = across * like.normal;
      if (!above_the_stand(spot.normal, up)) continue;
    }
    Eigen::Isometry3d pose(turn_of(by_rad, random) * like.orientation);
    pose.translation() = spot.from + spot.radius_m * spot.normal;
    if ((pose.linear() * shaft).dot(-spot.normal) < cone) continue;
    const auto contact = inverse(arm, pose, moved_along(arm.robot(), like.contact, by_rad, random),
                                 options.limit_margin_rad);
    if (!contact) continue;
    auto candidate = try_touch(with, spot, pose.linear(), *contact);
    if (!candidate) continue;
    candidate->target = like.target;
    result.push_back(std::move(*candidate));
  }
  return result;
}

std::string direction_words(const Eigen::Vector3d& normal) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", normal.x(), normal.y(), normal.z());
}

std::optional<Hindrance> hindrance(const Cell& cell, const ArmModel& arm,
                                   const Clearance& clearance, const PlanOptions& options,
                                   std::size_t target) {
  Cell alone = cell;  // keeps the indices; no touches of other targets are generated
  for (std::size_t t = 0; t < alone.targets.size(); ++t)
    if (t != target) alone.targets[t].kind = TargetKind::kPoint;
  struct Reason : Hindrance {
    int count = 1;
  };
  std::vector<Reason> reasons;  // hits of the same objects are merged
  for (const Candidate& c : find_candidates(alone, arm, Clearance::blind(), options, kTriedAlone,
                                            Kinds::kSpheresAndPlanes)) {
    const auto hit = first_collision(clearance, c);
    if (!hit) continue;
    const auto like = std::find_if(reasons.begin(), reasons.end(),
                                   [&](const Reason& one) { return one.hit.is_like(*hit); });
    if (like == reasons.end())
      reasons.push_back({{*hit, c.normal}});
    else
      ++like->count;
  }
  const auto most =
      std::max_element(reasons.begin(), reasons.end(),
                       [](const Reason& a, const Reason& b) { return a.count < b.count; });
  if (most == reasons.end()) return std::nullopt;
  return *most;
}

bool clear_line(const Clearance& clearance, const Candidate& c) {
  return clearance.clear_search(c.clear, c.within, c.target) &&
         (c.within == c.end || clearance.clear_past(c.within, c.end, c.target));
}

}  // namespace cellcal::calib
