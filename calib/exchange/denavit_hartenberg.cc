#include "calib/exchange/denavit_hartenberg.h"

#include <algorithm>
#include <cmath>

#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kParallelRad = 1.0 * kRadPerDeg;
constexpr double kNothingM = 1e-9;
constexpr double kNothingRad = 1e-9;

/// An axis at angle zero, base frame.
struct Line {
  Vector3d point, z;
  int sign;  ///< -1: the joint turns against z
};

Line line_of(const Isometry3d& frame, const Vector3d& axis) {
  Line line{frame.translation(), (frame.linear() * axis).normalized(), 1};
  // A hair more for y and z: at 45 deg rounding must not decide.
  const Vector3d weighed = line.z.cwiseAbs().cwiseProduct(Vector3d(1.0, 1.0 + 1e-6, 1.0 + 2e-6));
  Eigen::Index largest = 0;
  weighed.maxCoeff(&largest);
  if (line.z[largest] < 0.0) {
    line.z = -line.z;
    line.sign = -1;
  }
  return line;
}

double tidy(double value, double nothing) { return std::abs(value) < nothing ? 0.0 : value; }

/// Angle from x of `frame` about its z to the direction.
double angle_about_z(const Isometry3d& frame, const Vector3d& direction) {
  const Vector3d local = frame.linear().transpose() * direction;
  return std::atan2(local.y(), local.x());
}

/// To the next axis by the common normal: theta, d, a, alpha.
void by_normal(const Isometry3d& at, const Line& next, Joint& joint) {
  const Vector3d z = at.linear().col(2);
  const Vector3d between = next.point - at.translation();
  Vector3d x = z.cross(next.z);
  const double sine = x.norm();
  x /= sine;
  // Foot of the common normal along this axis, and how long it is along x.
  joint.d_m = tidy(between.cross(next.z).dot(x) / sine, kNothingM);
  joint.a_m = tidy(between.dot(x), kNothingM);
  if (joint.a_m < 0.0) {  // x points to the next axis
    x = -x;
    joint.a_m = -joint.a_m;
  }
  joint.offset_rad = tidy(angle_about_z(at, x), kNothingRad);
  joint.alpha_rad = std::atan2(z.cross(next.z).dot(x), z.dot(next.z));
  joint.errors = {JointError::kTheta, JointError::kD, JointError::kA, JointError::kAlpha};
}

/// To a nearly parallel one: its point in the plane across this axis, so d is nothing.
void across(const Isometry3d& at, const Line& next, Joint& joint) {
  const Vector3d z = at.linear().col(2);
  const Vector3d point =
      next.point + next.z * ((at.translation() - next.point).dot(z) / next.z.dot(z));
  const Vector3d between = point - at.translation();
  joint.a_m = tidy(between.norm(), kNothingM);
  joint.offset_rad = joint.a_m > 0.0 ? tidy(angle_about_z(at, between), kNothingRad) : 0.0;
  const Vector3d v =
      AngleAxisd(-joint.offset_rad, Vector3d::UnitZ()) * (at.linear().transpose() * next.z);
  joint.beta_rad = tidy(std::asin(std::clamp(v.x(), -1.0, 1.0)), kNothingRad);
  joint.alpha_rad = tidy(std::atan2(-v.y(), v.z()), kNothingRad);
  joint.errors = {JointError::kTheta, JointError::kA, JointError::kAlpha, JointError::kBeta};
}

/// To the flange, as far as theta, d and a carry it.
void to_flange(const Isometry3d& at, const Isometry3d& flange, Joint& joint) {
  const Isometry3d rest = at.inverse() * flange;
  joint.d_m = tidy(rest.translation().z(), kNothingM);
  joint.errors = {JointError::kTheta, JointError::kD, JointError::kA, JointError::kAlpha};
  if (rest.linear()(2, 2) > 0.0 && rest.linear().col(2).head<2>().norm() < kParallelRad)
    joint.offset_rad = tidy(std::atan2(rest.linear()(1, 0), rest.linear()(0, 0)), kNothingRad);
}

/// On the first axis, where the base's origin is nearest to it; x as the base's, as far as it can.
Isometry3d first_frame(const Line& line) {
  Isometry3d frame = Isometry3d::Identity();
  frame.translation() = line.point - line.z * line.z.dot(line.point);
  const Vector3d along = std::abs(line.z.x()) < 0.9 ? Vector3d::UnitX() : Vector3d::UnitY();
  const Vector3d x = (along - line.z * line.z.dot(along)).normalized();
  frame.linear() << x, line.z.cross(x), line.z;
  return frame;
}

/// Rounding taken out of what is nothing.
Isometry3d tidy(Isometry3d frame) {
  if (frame.isApprox(Isometry3d::Identity(), kNothingM)) return Isometry3d::Identity();
  return frame;
}

}  // namespace

Robot robot_of(const JointFrames& frames) {
  std::vector<Line> lines;
  std::vector<Isometry3d> links;  // behind each joint, angles zero
  Isometry3d link = Isometry3d::Identity();
  for (const PlacedJoint& one : frames.joints) {
    link = link * one.origin;
    links.push_back(link);
    lines.push_back(line_of(link, one.axis));
  }
  Robot robot;
  robot.base_fixed = tidy(first_frame(lines.front()));
  Isometry3d at = robot.base_fixed;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const PlacedJoint& one = frames.joints[i];
    Joint& joint = robot.joints.emplace_back();
    joint.name = one.name;
    joint.sign = lines[i].sign;
    joint.min_rad = one.min_rad;
    joint.max_rad = one.max_rad;
    joint.max_speed_rad_s = one.max_speed_rad_s;
    if (i + 1 == lines.size()) {
      to_flange(at, link * frames.flange, joint);
    } else {
      Line& next = lines[i + 1];
      const Vector3d z = at.linear().col(2);
      const bool parallel = z.cross(next.z).norm() < std::sin(kParallelRad);
      if (parallel && z.dot(next.z) < 0.0) next = {next.point, -next.z, -next.sign};
      if (parallel)
        across(at, next, joint);
      else
        by_normal(at, next, joint);
    }
    at = at * behind(joint);
    joint.mass_kg = one.mass_kg;
    if (one.mass_kg > 0.0) joint.com_m = at.inverse() * (links[i] * one.com_m);
  }
  robot.flange_fixed = tidy(at.inverse() * (link * frames.flange));
  return robot;
}

}  // namespace cellcal::calib
