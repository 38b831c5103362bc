#include "tests/calib/plan/collisions.h"

#include <algorithm>
#include <cmath>

#include "calib/plan/track.h"

namespace cellcal::calib::testing {

namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kPointsM = 0.002;  // spacing of points on an axis, if something is near

Vector3d up_in(const Cell& cell) {
  const Vector3d g = cell.robot.gravity_m_s2;
  return g.norm() > 0.0 ? Vector3d(-g / g.norm()) : Vector3d::UnitZ();
}

/// z along `axis`.
Isometry3d standing(const Vector3d& axis, const Vector3d& middle) {
  Isometry3d frame = Isometry3d::Identity();
  frame.linear() = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), axis).toRotationMatrix();
  frame.translation() = middle;
  return frame;
}

double off_line(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d ab = b - a;
  const double length2 = ab.dot(ab);
  double share = length2 > 0.0 ? (p - a).dot(ab) / length2 : 0.0;
  share = std::min(1.0, std::max(0.0, share));
  return (p - (a + share * ab)).norm();
}

/// The foot of the perpendicular if it lies inside, otherwise an edge.
double off_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d n = (b - a).cross(c - a).normalized();
  const double height = n.dot(p - a);
  const Vector3d foot = p - height * n;
  const bool inside = n.dot((b - a).cross(foot - a)) >= 0.0 &&
                      n.dot((c - b).cross(foot - b)) >= 0.0 &&
                      n.dot((a - c).cross(foot - c)) >= 0.0;
  if (inside) return std::abs(height);
  return std::min({off_line(p, a, b), off_line(p, b, c), off_line(p, c, a)});
}

void nearer(Nearest& best, double gap_m, const std::string& one, const std::string& other) {
  if (gap_m < best.gap_m) best = {gap_m, one + " - " + other};
}

}  // namespace

void Approach::take(const Approach& other) {
  for (auto [mine, theirs] :
       {std::pair{&tip, &other.tip}, std::pair{&body, &other.body}, std::pair{&self, &other.self}})
    if (theirs->gap_m < mine->gap_m) *mine = *theirs;
}

Collisions::Collisions(const Cell& cell) : cell_(cell), arm_(cell.robot, cell.tool) {
  const Vector3d up = up_in(cell);
  for (std::size_t t = 0; t < cell.targets.size(); ++t) {
    const Target& target = cell.targets[t];
    if (!target.has_centre || target.kind != TargetKind::kSphere) continue;
    const double radius = target.diameter_m / 2.0;
    const int index = static_cast<int>(t);
    shapes_.push_back({Shape::Kind::kBall,
                       "sphere " + target.id,
                       index,
                       standing(up, target.centre_m),
                       Vector3d(radius, 0, 0),
                       {}});
    if (!target.has_stand) continue;
    double below = 0.25;  // as documented
    if (cell.floor_m) below = std::max(1e-3, target.centre_m.dot(up) - radius - *cell.floor_m);
    if (target.stand_height_m > 0.0) below = target.stand_height_m;
    const double thick =
        target.stand_diameter_m > 0.0 ? target.stand_diameter_m : std::min(0.03, target.diameter_m);
    const double length = radius + below;
    shapes_.push_back({Shape::Kind::kPost,
                       "stand " + target.id,
                       index,
                       standing(up, target.centre_m - up * (length / 2.0)),
                       Vector3d(thick / 2.0, thick / 2.0, length / 2.0),
                       {}});
  }
  for (const Obstacle& o : cell.obstacles) {
    Shape shape{Shape::Kind::kBox, "obstacle " + o.id, -1, o.frame, o.size_m / 2.0, {}};
    if (o.shape == ObstacleShape::kCylinder) {
      shape.kind = Shape::Kind::kPost;
      shape.half = Vector3d(o.diameter_m / 2.0, o.diameter_m / 2.0, o.height_m / 2.0);
    } else if (o.shape == ObstacleShape::kMesh) {
      shape.kind = Shape::Kind::kTriangles;
      for (const auto& triangle : o.mesh->triangles)
        for (const int corner : triangle)
          shape.corners.push_back(o.frame * o.mesh->vertices_m[static_cast<std::size_t>(corner)]);
    }
    shapes_.push_back(shape);
  }
  if (cell.floor_m)
    shapes_.push_back(
        {Shape::Kind::kFloor, "floor", -1, standing(up, *cell.floor_m * up), Vector3d::Zero(), {}});
}

double Collisions::distance_m(const Shape& shape, const Vector3d& point) {
  if (shape.kind == Shape::Kind::kTriangles) {
    double least = std::numeric_limits<double>::max();
    for (std::size_t k = 0; k + 2 < shape.corners.size(); k += 3)
      least = std::min(
          least, off_triangle(point, shape.corners[k], shape.corners[k + 1], shape.corners[k + 2]));
    return least;
  }
  const Vector3d p = shape.frame.linear().transpose() * (point - shape.frame.translation());
  switch (shape.kind) {
    case Shape::Kind::kBall: return p.norm() - shape.half.x();
    case Shape::Kind::kPost:
      return std::hypot(std::max(0.0, std::hypot(p.x(), p.y()) - shape.half.x()),
                        std::max(0.0, std::abs(p.z()) - shape.half.z()));
    case Shape::Kind::kFloor: return p.z();
    default: break;
  }
  double sum = 0.0;
  for (int k = 0; k < 3; ++k) sum += std::pow(std::max(0.0, std::abs(p[k]) - shape.half[k]), 2);
  return std::sqrt(sum);
}

std::vector<Collisions::Rod> Collisions::rods(const JointVector& q) const {
  const ArmShape shape = arm_.shape(arm_.prepare(q), nullptr);
  const auto& joints = cell_.robot.joints;
  double reach = cell_.robot.flange_fixed.translation().norm();
  for (std::size_t i = 1; i < joints.size(); ++i) reach += std::hypot(joints[i].d_m, joints[i].a_m);
  const double usual = std::max(0.06, 0.1 * reach / 1.34);
  std::vector<Rod> result;
  for (std::size_t i = 0; i < joints.size(); ++i)
    result.push_back({"link " + joints[i].name,
                      joints[i].radius_m > 0.0 ? joints[i].radius_m : usual, false, i > 0,
                      static_cast<int>(i), shape.joint_origin_m[i], shape.joint_origin_m[i + 1]});
  const Tool& tool = cell_.tool;
  const int last = static_cast<int>(joints.size()) - 1;
  const Vector3d flange = shape.flange.translation(), tcp = shape.tcp.translation();
  const double length = (tcp - flange).norm();
  const Vector3d back = length > 0.0 ? Vector3d((flange - tcp) / length) : Vector3d::Zero();
  const double slim = std::min(length, tool.slim_length_m);
  if (length > tool.slim_length_m)
    result.push_back({"shaft", tool.radius_m, false, true, last, flange, tcp + slim * back});
  // The nose is round and ends with the ball.
  const double nose = std::min(slim, std::max(0.0, tool.slim_radius_m - tool.tip_radius_m));
  result.push_back(
      {"slim end", tool.slim_radius_m, true, true, last, tcp + slim * back, tcp + nose * back});
  if (tool.tip_radius_m > tool.slim_radius_m)
    result.push_back({"ball", tool.tip_radius_m, true, true, last, tcp, tcp});
  return result;
}

Approach Collisions::at(const JointVector& q, int touched, bool past) const {
  Approach result;
  const std::vector<Rod> all = rods(q);
  for (const Rod& rod : all) {
    if (!rod.moves) continue;
    const double length = (rod.b - rod.a).norm();
    const bool far_out = rod.tip || rod.joint == static_cast<int>(q.size()) - 1;
    // Steps by the clearance, within which there is nothing.
    for (double s = 0.0, step = 0.0;; s = std::min(length, s + step)) {
      const Vector3d p = length > 0.0 ? Vector3d(rod.a + (s / length) * (rod.b - rod.a)) : rod.a;
      step = std::numeric_limits<double>::max();
      for (const Shape& shape : shapes_) {
        if ((rod.tip || past) && touched >= 0 && shape.target == touched) continue;
        const double gap = distance_m(shape, p) - rod.radius_m;
        step = std::min(step, gap);
        nearer(rod.tip ? result.tip : result.body, gap, rod.words, shape.words);
      }
      for (std::size_t k = 0; k < 2 && far_out && q.size() >= 6; ++k) {
        const double gap = off_line(p, all[k].a, all[k].b) - all[k].radius_m - rod.radius_m;
        step = std::min(step, gap);
        nearer(result.self, gap, rod.words, all[k].words);
      }
      if (s >= length) break;
      step = std::max(kPointsM, step);
    }
  }
  return result;
}

Approach Collisions::along(const JointVector& from, const JointVector& to, int touched,
                           double step_rad, bool past) const {
  double most = 0.0;
  for (std::size_t i = 0; i < from.size(); ++i) most = std::max(most, std::abs(to[i] - from[i]));
  const int steps = std::max(1, static_cast<int>(std::ceil(most / step_rad)));
  Approach result;
  JointVector q(from.size());
  for (int k = 0; k <= steps; ++k) {
    const double share = static_cast<double>(k) / steps;
    for (std::size_t i = 0; i < q.size(); ++i) q[i] = (1.0 - share) * from[i] + share * to[i];
    result.take(at(q, touched, past));
  }
  return result;
}

Approach Collisions::across(const JointVector& from, const JointVector& at, const JointVector& to,
                            const Corner& corner) const {
  const auto on_leg = [&](const JointVector& other, double share) {
    JointVector q(at);
    for (std::size_t i = 0; i < q.size(); ++i) q[i] += share * (other[i] - at[i]);
    return q;
  };
  Approach result;
  for (const double part : {1.0, 0.6, 0.2})
    result.take(along(on_leg(from, part * corner.in_share), on_leg(to, part * corner.out_share)));
  return result;
}

Approach Collisions::of(const Plan& plan) const {
  Approach result;
  const bool large = with_tolerances({}, cell_).arm_off_m > 0.0;
  JointVector where = plan.start, before;
  for (const PlannedTouch& touch : plan.touches) {
    if (!before.empty()) result.take(across(before, where, touch.transit.front(), touch.leaving));
    for (std::size_t k = 0; k < touch.transit.size(); ++k) {
      const JointVector& next = touch.transit[k];
      result.take(along(where, next));
      if (k + 1 < touch.transit.size() && k < touch.corners.size())
        result.take(across(where, next, touch.transit[k + 1], touch.corners[k]));
      where = next;
    }
    before = touch.end;
    const int target = static_cast<int>(cell_.target_index(touch.target));
    const double within_m = large ? touch.expected_m + PlanOptions().beyond_m : touch.search_m;
    const JointVector within = interpolated(touch.standoff, touch.end, within_m / touch.search_m);
    result.take(along(touch.standoff, within, target));
    result.take(along(within, touch.end, target, 0.0035, true));
    result.take(along(within, touch.clear, target));
    where = touch.clear;
  }
  for (const JointVector& next : plan.home) {
    result.take(along(where, next));
    where = next;
  }
  return result;
}

}  // namespace cellcal::calib::testing
