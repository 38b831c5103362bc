#include "tests/experiments/constraints/stage.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "calib/estimate/region.h"
#include "calib/model/inverse.h"
#include "calib/model/linear.h"
#include "sim/cell/truth.h"

namespace cellcal::sim::constraints {

Eigen::Matrix3d random_orientation(const calib::Tool& tool, calib::Random& random,
                                   const Eigen::Vector3d& normal, double cone_rad) {
  const double pi = std::numbers::pi;
  const Eigen::Vector3d shaft = tool.tcp.translation().normalized();
  const Eigen::AngleAxisd roll(random.uniform(-pi, pi), -normal);
  const Eigen::AngleAxisd heading(random.uniform(-pi, pi), normal);
  const Eigen::AngleAxisd tilt(cone_rad * std::sqrt(random.uniform()),
                               heading * normal.unitOrthogonal());
  return (tilt * roll).toRotationMatrix() *
         Eigen::Quaterniond::FromTwoVectors(shaft, -normal).toRotationMatrix() * tool.tcp.linear();
}

calib::JointVector random_posture(const calib::Robot& robot, calib::Random& random,
                                  const Eigen::Vector3d& at) {
  calib::JointVector q(robot.joints.size(), 0.0);
  const std::size_t arm = robot.first_turning();
  if (q.size() >= arm + 6) q[arm + 1] = -1.2, q[arm + 2] = 1.6, q[arm + 4] = 1.0;
  q = facing(robot, q, at);
  if (arm > 0) q[0] += random.uniform(-0.4, 0.4);
  for (std::size_t i = arm + 1; i < q.size(); ++i) {
    const double spread = i < arm + 3 ? 0.4 : 1.5;
    q[i] += random.uniform(-spread, spread);
  }
  for (std::size_t i = 0; i < q.size(); ++i)
    q[i] = std::clamp(q[i], robot.joints[i].min_rad, robot.joints[i].max_rad);
  return q;
}

namespace {

using calib::JointVector;
using calib::Random;
using calib::TargetKind;
using Eigen::Vector3d;

/// Touches from further below would collide with the post.
constexpr double kLowestElevationRad = -0.35;
constexpr double kLimitMarginRad = 0.01;
constexpr double kPlaneTiltRad = 0.005;

Vector3d random_direction(Random& random) {
  const double z = random.uniform(-1.0, 1.0), r = std::sqrt(1.0 - z * z);
  const double turn = random.uniform(-std::numbers::pi, std::numbers::pi);
  return {r * std::cos(turn), r * std::sin(turn), z};
}

Vector3d random_normal(Random& random) {
  while (true) {
    const Vector3d n = random_direction(random);
    if (n.z() > std::sin(kLowestElevationRad)) return n;
  }
}

/// Joint angles with the true tip at `point` and the tool within the normal's cone; empty if
/// outside the limits.
JointVector reach(const Stage& stage, Random& random, const Vector3d& point, const Vector3d& normal,
                  double cone_rad) {
  const auto& joints = stage.cell.robot.joints;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = point;
  pose.linear() = random_orientation(stage.cell.tool, random, normal, cone_rad);
  const auto found = calib::inverse(
      stage.truth.arm, pose, random_posture(stage.cell.robot, random, point), kLimitMarginRad);
  if (!found) return {};
  JointVector q = *found;
  // Newton's method with nominal derivatives, which are accurate to parts in a thousand.
  constexpr double kThere = 1e-13;
  constexpr int kSteps = 12;
  for (int k = 0; k < kSteps; ++k) {
    const Vector3d off =
        point - stage.truth.arm.position(stage.truth.arm.prepare(q), stage.truth.errors.data());
    if (off.norm() < kThere) {
      for (std::size_t i = 0; i < q.size(); ++i)
        if (q[i] < joints[i].min_rad || q[i] > joints[i].max_rad) return {};
      return q;
    }
    const Eigen::Matrix3Xd j = stage.truth.arm.nominal_jacobian(q).topRows<3>();
    const Eigen::VectorXd step = j.transpose() * (j * j.transpose()).inverse() * off;
    for (std::size_t i = 0; i < q.size(); ++i) q[i] += step[static_cast<Eigen::Index>(i)];
  }
  return {};
}

/// One attempt; without joint angles if out of reach.
calib::Touch attempt(const Stage& stage, std::size_t t, const TouchOptions& options,
                     Random& random) {
  const calib::Target& target = stage.cell.targets[t];
  calib::Touch touch;
  touch.target = target.id;
  const double off = options.noise_m * random.normal();
  const Vector3d off3 =
      options.noise_m * Vector3d(random.normal(), random.normal(), random.normal());
  Vector3d point = stage.truth.centre_m[t], normal = random_normal(random);
  switch (target.kind) {
    case TargetKind::kSphere:
      point += (stage.truth.radius_m[t] + options.rho_m + off) * normal;
      break;
    case TargetKind::kWire: {
      const double length = random.uniform(options.wire_least_m, options.wire_most_m);
      point += length * random_direction(random);
      touch.radius_m = length + off;
      break;
    }
    case TargetKind::kPlane: {
      normal = stage.normal[t];
      const Vector3d along = normal.unitOrthogonal(), across = normal.cross(along);
      const double half = options.plane_half_m;
      point += random.uniform(-half, half) * along + random.uniform(-half, half) * across +
               (stage.cell.tool.tip_radius_m + options.rho_m + off) * normal;
      break;
    }
    case TargetKind::kPoint: point += off3; break;
    case TargetKind::kTracker: {
      const auto poses = calib::workspace_poses(stage.truth.arm, 1,
                                                static_cast<unsigned>(random.below(1'000'000'000)));
      if (poses.empty()) return touch;
      touch.joint_rad = poses.front();
      const Vector3d tip = stage.truth.arm.position(stage.truth.arm.prepare(touch.joint_rad),
                                                    stage.truth.errors.data());
      const Vector3d reading = stage.frame[t].inverse() * tip + off3;
      for (int k = 0; k < 3; ++k) touch.tracker_m[k] = reading[k];
      return touch;
    }
  }
  touch.joint_rad = reach(stage, random, point, normal, options.cone_rad);
  return touch;
}

}  // namespace

Stage set_up(const calib::Cell& cell, const TruthOptions& options) {
  Stage stage{cell, draw_truth(cell, options), {}, {}};
  Random random(options.seed + 7919);  // independent of the arm's draws
  for (const calib::Target& target : cell.targets) {
    const Vector3d w = kPlaneTiltRad * Vector3d(random.normal(), random.normal(), random.normal());
    stage.normal.push_back(Eigen::AngleAxisd(w.norm(), w.normalized()) * target.normal);
    Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
    frame.linear() =
        Eigen::AngleAxisd(random.uniform(-3.0, 3.0), random_direction(random)).toRotationMatrix();
    frame.translation() = random.uniform(2.0, 4.0) * random_direction(random);
    stage.frame.push_back(frame);
  }
  for (calib::CertifiedLength& length : stage.cell.lengths) {
    length.length_m = (stage.truth.centre_m[cell.target_index(length.from)] -
                       stage.truth.centre_m[cell.target_index(length.to)])
                          .norm();
    length.length_m += length.sigma_m * std::clamp(random.normal(), -2.0, 2.0);
  }
  return stage;
}

std::vector<calib::Touch> touch(const Stage& stage, const TouchOptions& options) {
  constexpr int kAttempts = 2000;
  Random random(options.seed);
  std::vector<calib::Touch> touches;
  for (int i = 0; i < options.fit + options.check; ++i) {
    const std::size_t t = static_cast<std::size_t>(i) % stage.cell.targets.size();
    calib::Touch one;
    for (int k = 0; one.joint_rad.empty(); ++k) {
      if (k == kAttempts)
        throw std::runtime_error("no touch of target " + stage.cell.targets[t].id +
                                 " is within reach");
      one = attempt(stage, t, options, random);
    }
    one.set = i < options.fit ? calib::TouchSet::kFit : calib::TouchSet::kCheck;
    touches.push_back(std::move(one));
  }
  return touches;
}

namespace {

/// Places of four spheres or points: those of the demo.
const Vector3d kPlaces[] = {
    {1.08, -0.32, 0.33}, {1.06, 0.38, 0.33}, {0.64, -0.62, 0.64}, {0.76, 0.56, 0.78}};
constexpr double kDiameterM = 0.0614, kDiameterSigmaM = 2e-6;
constexpr double kCentreSigmaM = 0.010;
constexpr double kLengthSigmaM = 5e-6;

calib::Target target(const std::string& id, TargetKind kind, const Vector3d& at) {
  calib::Target t;
  t.id = id;
  t.kind = kind;
  if (kind == TargetKind::kTracker) return t;
  t.has_centre = true;
  t.centre_m = at;
  t.centre_sigma_m = kCentreSigmaM;
  if (kind == TargetKind::kSphere) {
    t.diameter_m = kDiameterM;
    t.diameter_sigma_m = kDiameterSigmaM;
  }
  return t;
}

calib::Cell with(const calib::Cell& base, TargetKind kind, std::size_t count, bool lengths) {
  calib::Cell cell = base;
  cell.targets.clear();
  cell.lengths.clear();
  for (std::size_t i = 0; i < count; ++i)
    cell.targets.push_back(target("T" + std::to_string(i + 1), kind, kPlaces[i]));
  for (std::size_t a = 0; lengths && a < count; ++a)
    for (std::size_t b = a + 1; b < count; ++b)
      cell.lengths.push_back({cell.targets[a].id, cell.targets[b].id, 1.0, kLengthSigmaM});
  return cell;
}

/// Three plates facing the arm from different sides.
calib::Cell planes(const calib::Cell& base) {
  calib::Cell cell = with(base, TargetKind::kPlane, 3, false);
  const Vector3d places[] = {{1.0, 0.0, 0.35}, {0.8, 0.5, 0.5}, {0.9, -0.5, 0.6}};
  const Vector3d normals[] = {{0, 0, 1}, {-1, -1, 1}, {-1, 1, 0.6}};
  for (std::size_t i = 0; i < 3; ++i) {
    cell.targets[i].centre_m = places[i];
    cell.targets[i].has_normal = true;
    cell.targets[i].normal = normals[i].normalized();
  }
  return cell;
}

}  // namespace

std::vector<Layout> layouts(const calib::Cell& base) {
  return {{"1 sphere", with(base, TargetKind::kSphere, 1, false), false},
          {"4 spheres", with(base, TargetKind::kSphere, 4, false), false},
          {"4 spheres, lengths", with(base, TargetKind::kSphere, 4, true), true},
          {"1 wire", with(base, TargetKind::kWire, 1, false), true},
          {"3 planes", planes(base), false},
          {"4 points", with(base, TargetKind::kPoint, 4, false), false},
          {"4 points, lengths", with(base, TargetKind::kPoint, 4, true), true},
          {"tracker", with(base, TargetKind::kTracker, 1, false), true}};
}

}  // namespace cellcal::sim::constraints
