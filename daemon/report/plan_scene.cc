#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <stdexcept>

#include "calib/files/files.h"
#include "calib/model/kinematics.h"
#include "calib/model/linear.h"
#include "calib/plan/bodies.h"
#include "calib/plan/positioner_plan.h"
#include "calib/plan/surroundings.h"
#include "daemon/report/plan_picture.h"

namespace cellcal::daemon::report {

namespace {

using calib::kMmPerM;
using Eigen::Vector2d, Eigen::Vector3d;

constexpr int kCorners = 24;  // per circle

std::vector<Vector3d> rim_of(const Eigen::Isometry3d& frame, double radius_m, double z_m) {
  std::vector<Vector3d> rim;
  for (int k = 0; k < kCorners; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / kCorners;
    rim.push_back(kMmPerM *
                  (frame * Vector3d(radius_m * std::cos(angle), radius_m * std::sin(angle), z_m)));
  }
  return rim;
}

std::vector<Vector3d> corners_of(const calib::Obstacle& o) {
  std::vector<Vector3d> corners;
  switch (o.shape) {
    case calib::ObstacleShape::kBox:
      for (const double x : {-0.5, 0.5})
        for (const double y : {-0.5, 0.5})
          for (const double z : {-0.5, 0.5})
            corners.push_back(kMmPerM * (o.frame * Vector3d(x * o.size_m.x(), y * o.size_m.y(),
                                                            z * o.size_m.z())));
      break;
    case calib::ObstacleShape::kCylinder:
      for (const double end : {-0.5, 0.5}) {
        const auto rim = rim_of(o.frame, o.diameter_m / 2.0, end * o.height_m);
        corners.insert(corners.end(), rim.begin(), rim.end());
      }
      break;
    case calib::ObstacleShape::kMesh:
      if (o.mesh == nullptr) break;
      for (const Vector3d& vertex : o.mesh->vertices_m)
        corners.push_back(kMmPerM * (o.frame * vertex));
      break;
  }
  return corners;
}

calib::ArmModel arm_of(const calib::Cell& cell) {
  if (cell.robot.joints.empty()) throw std::invalid_argument("the robot has no joints");
  return {cell.robot, cell.tool};
}

/// Approximate posture within the limits that maximises `worth`.
template <typename Worth>
calib::JointVector furthest(const calib::Robot& robot, calib::JointVector q, const Worth& worth) {
  constexpr double kFirstRad = 0.3, kLastRad = 0.003;
  double best = worth(q);
  for (double step = kFirstRad; step > kLastRad;) {
    bool better = false;
    for (std::size_t i = 0; i < q.size(); ++i)
      for (const double turn : {-step, step}) {
        const double old = q[i];
        q[i] = std::max(robot.joints[i].min_rad, std::min(robot.joints[i].max_rad, old + turn));
        if (const double now = worth(q); now > best) {
          best = now;
          better = true;
        } else {
          q[i] = old;
        }
      }
    if (!better) step /= 2.0;
  }
  return q;
}

/// From where the touched target is to where the positioner at 0 has it.
Eigen::Isometry3d back_to_zero(const calib::Cell& cell, const calib::PlannedTouch& touch) {
  const auto target = std::ranges::find(cell.targets, touch.target, &calib::Target::id);
  if (target == cell.targets.end() || target->carried_by == 0) return Eigen::Isometry3d::Identity();
  const auto axes = static_cast<std::size_t>(target->carried_by);
  if (touch.positioner_rad.size() < axes)
    throw std::invalid_argument("the plan is of another robot");
  return carried_at(cell.robot, std::vector<double>(axes)) *
         carried_at(cell.robot, std::span(touch.positioner_rad).first(axes)).inverse();
}

std::vector<PlanScene::Axle> axles_of(const calib::Robot& robot) {
  constexpr double kHalfMm = 300.0;
  std::vector<PlanScene::Axle> axles;
  for (std::size_t j = 0; j < robot.positioner.size(); ++j) {
    const Eigen::Isometry3d place = carried_at(robot, std::vector<double>(j + 1));
    const Vector3d middle = kMmPerM * place.translation(), z = place.linear().col(2);
    axles.push_back({robot.positioner[j].name, middle - kHalfMm * z, middle + kHalfMm * z});
  }
  return axles;
}

}  // namespace

bool z_is_up(const calib::Robot& robot) {
  constexpr double kNearlyUp = 0.99;
  return calib::up_of(robot).z() > kNearlyUp;
}

PlanScene scene_of(const calib::Cell& stated, const calib::Plan& plan) {
  const std::size_t positioner = stated.robot.positioner.size();
  const calib::Cell cell =
      positioner == 0 ? stated : at_setting(stated, std::vector<double>(positioner));
  const calib::ArmModel arm = arm_of(cell);
  if (plan.start.size() != cell.robot.joints.size())
    throw std::invalid_argument("the plan is of another robot");
  PlanScene scene;
  const calib::Bodies bodies(arm);
  std::vector<calib::Segment> axes;
  bodies.place(plan.start, axes);
  for (std::size_t k = 0; k < axes.size(); ++k)
    scene.arm.push_back({kMmPerM * axes[k].a, kMmPerM * axes[k].b,
                         kMmPerM * bodies.list()[k].radius_m, k >= cell.robot.joints.size()});
  scene.axles = axles_of(stated.robot);
  scene.z_is_up = z_is_up(cell.robot);
  if (cell.floor_m && scene.z_is_up) scene.floor_z = *cell.floor_m * kMmPerM;
  for (const calib::Obstacle& obstacle : cell.obstacles)
    if (auto corners = corners_of(obstacle); !corners.empty())
      scene.solids.push_back({obstacle.id, std::move(corners)});
  for (const calib::Post& post : calib::posts_of(cell)) {
    PlanScene::Solid solid;
    for (const double end : {-0.5, 0.5}) {
      const auto rim = rim_of(post.frame, post.radius_m, end * post.length_m);
      solid.corners.insert(solid.corners.end(), rim.begin(), rim.end());
    }
    scene.solids.push_back(std::move(solid));
  }
  for (const calib::Target& target : cell.targets)
    if (target.has_centre && target.kind != calib::TargetKind::kTracker)
      scene.balls.push_back(
          {target.id, target.centre_m * kMmPerM, std::max(0.0, target.diameter_m / 2.0) * kMmPerM});
  for (std::size_t k = 0; k < plan.touches.size(); ++k) {
    const calib::PlannedTouch& touch = plan.touches[k];
    if (touch.standoff.size() != cell.robot.joints.size())
      throw std::invalid_argument("the plan is of another robot");
    const bool check = touch.set == calib::TouchSet::kCheck;
    // Centre of the tip at the stand-off, and the direction to the surface.
    const Vector3d standoff = arm.nominal_tip_m(touch.standoff);
    const Eigen::Isometry3d back = back_to_zero(stated, touch);
    scene.approaches.push_back({kMmPerM * (back * (standoff - touch.expected_m * touch.normal)),
                                back.linear() * touch.normal, check, k + 1});
    for (PlanScene::Ball& ball : scene.balls)
      if (ball.id == touch.target) ++(check ? ball.check : ball.fit);
  }
  return scene;
}

std::vector<Vector2d> reach_of(const calib::Cell& cell, int across, int upward) {
  const calib::ArmModel arm = arm_of(cell);
  constexpr int kPostures = 2000, kDirections = 48;
  calib::Random random(1);
  std::vector<calib::JointVector> postures;
  std::vector<Vector2d> tips;
  const auto seen = [&](const calib::JointVector& q) {
    const Vector3d tip = kMmPerM * arm.nominal_tip_m(q);
    return Vector2d(tip[across], tip[upward]);
  };
  for (int k = 0; k < kPostures; ++k) {
    calib::JointVector q;
    for (const calib::Joint& joint : cell.robot.joints)
      q.push_back(random.uniform(joint.min_rad, joint.max_rad));
    tips.push_back(seen(q));
    postures.push_back(std::move(q));
  }
  std::vector<Vector2d> corners;
  for (int k = 0; k < kDirections; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / kDirections;
    const Vector2d direction(std::cos(angle), std::sin(angle));
    std::size_t best = 0;
    for (std::size_t i = 1; i < tips.size(); ++i)
      if (tips[i].dot(direction) > tips[best].dot(direction)) best = i;
    corners.push_back(seen(furthest(cell.robot, postures[best], [&](const calib::JointVector& q) {
      return seen(q).dot(direction);
    })));
  }
  return outline_of(std::move(corners));
}

std::vector<Vector2d> outline_of(std::vector<Vector2d> points) {
  std::erase_if(points, [](const Vector2d& p) { return !p.allFinite(); });
  const auto before = [](const Vector2d& a, const Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  };
  std::sort(points.begin(), points.end(), before);
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() < 3) return points;
  std::vector<Vector2d> outline;
  const auto turns_left = [](const Vector2d& a, const Vector2d& b, const Vector2d& c) {
    return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x() > 0.0;
  };
  for (const int pass : {0, 1}) {  // lower hull, then upper
    const std::size_t first = outline.size();
    for (const Vector2d& p : points) {
      while (outline.size() >= first + 2 &&
             !turns_left(outline[outline.size() - 2], outline.back(), p))
        outline.pop_back();
      outline.push_back(p);
    }
    outline.pop_back();  // repeated as the first point of the next pass
    if (pass == 0) std::reverse(points.begin(), points.end());
  }
  return outline;
}

}  // namespace cellcal::daemon::report
