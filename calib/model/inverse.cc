#include "calib/model/inverse.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/model/linear.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

constexpr int kIterations = 60;
constexpr double kReached = 1e-9;        // m and rad
constexpr double kLargestStepRad = 0.3;  // trust region of Newton's method
/// Length that weighs as much as a radian: the wrist lever of a medium-sized arm.
constexpr double kLeverM = 0.5;
constexpr double kDamping = 1e-6;

/// Within the limits reduced by the margin, of a short range by a quarter of it at most.
bool within_limits(double value, const Joint& joint, double margin) {
  margin = std::min(margin, (joint.max_rad - joint.min_rad) / 4.0);
  return value >= joint.min_rad + margin && value <= joint.max_rad - margin;
}

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::size_t kWristJoints = 6;
using Angles6 = std::array<double, kWristJoints>;
/// Tolerance for rounding; nominal geometry is exact.
constexpr double kMeetM = 1e-9, kParallel = 1e-9;
/// An angle is undetermined if the point that it moves is this close to its axis.
constexpr double kOnAxis = 1e-9;
/// Solutions closer than this are identical.
constexpr double kSameRad = 1e-5;
constexpr int kSeeds = 24;
constexpr unsigned kSeed = 11;

Vector3d across(const Vector3d& v, const Vector3d& axis) { return v - axis.dot(v) * axis; }

/// Up to two angles; the first is the one at which the left side decreases.
struct Angles {
  std::array<double, 2> angle{};
  int count = 0;
  const double* begin() const { return angle.data(); }
  const double* end() const { return angle.data() + count; }
};

/// a cos x + b sin x = c. `falling`: returns only the solution at which the left side decreases
/// (true) or increases (false).
Angles angles(double a, double b, double c, std::optional<bool> falling) {
  const double size = std::hypot(a, b);
  if (!(size >= kOnAxis) || !(std::abs(c) <= size * (1.0 + 1e-12))) return {};
  const double middle = std::atan2(b, a), half = std::acos(std::clamp(c / size, -1.0, 1.0));
  if (half < kOnAxis) return {{middle}, 1};
  if (falling) return {{*falling ? middle + half : middle - half}, 1};
  return {{middle + half, middle - half}, 2};
}

/// Rotation about `axis` that maps `from` to `to`; 0 if both are on the axis.
double turn(const Vector3d& axis, const Vector3d& from, const Vector3d& to) {
  const Vector3d a = across(from, axis), b = across(to, axis);
  if (a.norm() < kOnAxis || b.norm() < kOnAxis) return 0.0;
  return std::atan2(axis.dot(a.cross(b)), a.dot(b));
}

/// The equivalent angle nearest to 0 within the limits.
std::optional<double> within(double angle, const Joint& joint, double margin) {
  angle = std::remainder(angle, kRadPerTurn);
  for (const double candidate : {angle, angle > 0.0 ? angle - kRadPerTurn : angle + kRadPerTurn,
                                 angle > 0.0 ? angle + kRadPerTurn : angle - kRadPerTurn})
    if (within_limits(candidate, joint, margin)) return candidate;
  return std::nullopt;
}

bool same(const JointVector& a, const JointVector& b) {
  for (std::size_t i = 0; i < a.size(); ++i)
    if (std::abs(a[i] - b[i]) > kSameRad) return false;
  return true;
}

void keep(std::vector<JointVector>& all, JointVector q) {
  if (std::none_of(all.begin(), all.end(),
                   [&](const JointVector& other) { return same(other, q); }))
    all.push_back(std::move(q));
}

}  // namespace

std::optional<JointVector> inverse(const ArmModel& arm, const Eigen::Isometry3d& tcp,
                                   const JointVector& seed, double margin_rad) {
  const auto& joints = arm.robot().joints;
  JointVector q = seed;
  for (int k = 0; k < kIterations; ++k) {
    const Eigen::Isometry3d now = arm.nominal_tcp(q);
    Eigen::Matrix<double, 6, 1> error;
    error.head<3>() = tcp.translation() - now.translation();
    const Eigen::AngleAxisd turn(tcp.linear() * now.linear().transpose());
    error.tail<3>() = turn.angle() * turn.axis();
    if (error.head<3>().norm() < kReached && error.tail<3>().norm() < kReached) {
      for (std::size_t i = 0; i < q.size(); ++i)
        if (!within_limits(q[i], joints[i], margin_rad)) return std::nullopt;
      return q;
    }
    Eigen::Matrix<double, 6, Eigen::Dynamic> j = arm.nominal_jacobian(q);
    j.leftCols(static_cast<Eigen::Index>(arm.robot().first_turning())).setZero();
    j.bottomRows<3>() *= kLeverM;
    error.tail<3>() *= kLeverM;
    Eigen::Matrix<double, 6, 6> jjt = j * j.transpose();
    // Far from the solution a step along a singular direction must stay small; near it Newton's
    // method must be exact.
    const double damping = kDamping * std::min(1.0, error.squaredNorm()) + 1e-15;
    jjt.diagonal().array() += damping;
    Eigen::VectorXd step = j.transpose() * jjt.ldlt().solve(error);  // (8)
    const double largest = step.cwiseAbs().maxCoeff();
    if (!std::isfinite(largest)) return std::nullopt;
    if (largest > kLargestStepRad) step *= kLargestStepRad / largest;
    for (std::size_t i = 0; i < q.size(); ++i)
      q[i] = std::clamp(q[i] + step[static_cast<Eigen::Index>(i)], joints[i].min_rad,
                        joints[i].max_rad);
  }
  return std::nullopt;
}

Configurations::Configurations(const ArmModel& arm, double margin_rad)
    : arm_(arm),
      margin_rad_(margin_rad),
      first_(arm.robot().first_turning()),
      wrist_(find_wrist(arm)) {}

std::optional<Configurations::Wrist> Configurations::find_wrist(const ArmModel& arm) {
  const std::size_t first = arm.robot().first_turning();
  if (arm.robot().joints.size() != first + kWristJoints) return std::nullopt;
  const JointVector zero(first + kWristJoints, 0.0);
  ArmChain chain;
  arm.walk(arm.prepare(zero), arm.errors(nullptr), chain);
  Wrist w;
  for (std::size_t i = 0; i < kWristJoints; ++i) {
    w.axis[i] = arm.robot().joints[first + i].sign * chain.link[first + i].z;
    w.point[i] = chain.link[first + i].z_origin;
  }
  if (w.axis[1].cross(w.axis[2]).norm() > kParallel) return std::nullopt;
  // Least-squares intersection of the last three axes.
  Matrix3d square = Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  for (std::size_t i = 3; i < kWristJoints; ++i) {
    const Matrix3d off = Matrix3d::Identity() - w.axis[i] * w.axis[i].transpose();
    square += off;
    right += off * w.point[i];
  }
  w.centre = square.ldlt().solve(right);
  for (std::size_t i = 3; i < kWristJoints; ++i)
    if (!(across(w.centre - w.point[i], w.axis[i]).norm() < kMeetM)) return std::nullopt;
  w.home = arm.nominal_tcp(zero);
  return w;
}

Isometry3d Configurations::from_carriage(const Isometry3d& tcp, double track_m) const {
  if (first_ == 0) return tcp;
  const Robot& robot = arm_.robot();
  Isometry3d seen = tcp;
  seen.translation() -= robot.base_fixed.linear() * (track_m * robot.joints[0].guide->along);
  return seen;
}

std::vector<JointVector> Configurations::reach(const Isometry3d& tcp, double track_m) const {
  std::vector<JointVector> all;
  for (JointVector& q : wrist_ ? closed(tcp, track_m) : from_seeds(tcp, track_m))
    keep(all, std::move(q));
  return all;
}

template <typename Finish>
void Configurations::by_subproblems(const Isometry3d& tcp, const Posture* wanted,
                                    const Finish& finish) const {
  const auto& [axis, point, centre, home] = *wrist_;
  const auto side = [&](bool Posture::*which) {
    return wanted == nullptr ? std::nullopt : std::optional(wanted->*which);
  };
  // exp(1) ... exp(6) = g. The last three leave the wrist centre fixed.
  const Isometry3d g = tcp * home.inverse();
  const Vector3d reached = g * centre;
  // Axis 1 returns the centre to its distance along axis 2, which axes 2 and 3 cannot change.
  const Vector3d v = reached - point[0];
  const Vector3d level = axis[0].dot(v) * axis[0];
  for (const double t1 : angles(
           axis[1].dot(v - level), -axis[1].dot(axis[0].cross(v)),
           axis[1].dot(centre - point[1]) - axis[1].dot(point[0] - point[1]) - axis[1].dot(level),
           side(&Posture::shoulder))) {
    const Matrix3d r1 = AngleAxisd(t1, axis[0]).toRotationMatrix();
    const Vector3d y = across(point[0] + r1.transpose() * v - point[1], axis[1]);
    // Axis 3 sets the centre's distance from axis 2.
    const Vector3d u = across(centre - point[2], axis[2]), s = across(point[1] - point[2], axis[2]);
    for (const double t3 : angles(s.dot(u), s.dot(axis[2].cross(u)),
                                  (u.squaredNorm() + s.squaredNorm() - y.squaredNorm()) / 2.0,
                                  side(&Posture::elbow))) {
      const Matrix3d r3 = AngleAxisd(t3, axis[2]).toRotationMatrix();
      const double t2 = turn(axis[1], point[2] + r3 * (centre - point[2]) - point[1], y);
      const Matrix3d r2 = AngleAxisd(t2, axis[1]).toRotationMatrix();
      const Matrix3d rest = (r1 * r2 * r3).transpose() * g.linear();
      // Axis 5 tilts axis 6 against axis 4.
      const Vector3d d = rest * axis[5];
      const Vector3d along = axis[4].dot(axis[5]) * axis[4];
      for (const double t5 :
           angles(axis[3].dot(axis[5] - along), axis[3].dot(axis[4].cross(axis[5])),
                  axis[3].dot(d) - axis[3].dot(along), side(&Posture::wrist))) {
        const Matrix3d r5 = AngleAxisd(t5, axis[4]).toRotationMatrix();
        const double t4 = turn(axis[3], r5 * axis[5], d);
        const Matrix3d r6 = (AngleAxisd(t4, axis[3]).toRotationMatrix() * r5).transpose() * rest;
        const Vector3d across_6 = axis[5].unitOrthogonal();
        finish({t1, t2, t3, t4, t5, turn(axis[5], across_6, r6 * across_6)});
      }
    }
  }
}

std::vector<JointVector> Configurations::closed(const Isometry3d& tcp, double track_m) const {
  const auto& joints = arm_.robot().joints;
  std::vector<JointVector> found;
  by_subproblems(from_carriage(tcp, track_m), nullptr, [&](const Angles6& theta) {
    JointVector q(first_, track_m);
    for (std::size_t i = 0; i < kWristJoints; ++i) {
      const auto angle = within(theta[i], joints[first_ + i], margin_rad_);
      if (!angle) return;
      q.push_back(*angle);
    }
    if (auto exact = inverse(arm_, tcp, q, margin_rad_)) found.push_back(std::move(*exact));
  });
  return found;
}

Posture Configurations::posture_of(const JointVector& q) const {
  const auto& [axis, point, centre, home] = *wrist_;
  const auto angle = [&](std::size_t i) { return q[first_ + i]; };
  const Vector3d behind_3 = AngleAxisd(angle(2), axis[2]) * (centre - point[2]);
  const Vector3d behind_2 =
      point[1] + AngleAxisd(angle(1), axis[1]) * (point[2] + behind_3 - point[1]);
  const Vector3d upper = across(point[1] - point[2], axis[2]);
  return {axis[1].dot(axis[0].cross(behind_2 - point[0])) > 0.0,
          upper.dot(axis[2].cross(behind_3)) < 0.0,
          axis[3].dot(axis[4].cross(AngleAxisd(angle(4), axis[4]) * axis[5])) < 0.0};
}

std::optional<JointVector> Configurations::in_posture(const Isometry3d& tcp, const Posture& posture,
                                                      double track_m) const {
  std::optional<JointVector> found;
  by_subproblems(from_carriage(tcp, track_m), &posture, [&](const Angles6& theta) {
    found.emplace(first_, track_m);
    for (const double angle : theta) found->push_back(std::remainder(angle, kRadPerTurn));
  });
  return found;
}

std::vector<JointVector> Configurations::from_seeds(const Isometry3d& tcp, double track_m) const {
  Random random(kSeed);  // deterministic for a pose
  std::vector<JointVector> found;
  for (int k = 0; k < kSeeds; ++k) {
    JointVector seed(first_, track_m);
    for (std::size_t i = first_; i < arm_.robot().joints.size(); ++i) {
      const Joint& joint = arm_.robot().joints[i];
      seed.push_back(random.uniform(std::max(joint.min_rad, -std::numbers::pi),
                                    std::min(joint.max_rad, std::numbers::pi)));
    }
    if (auto q = inverse(arm_, tcp, seed, margin_rad_)) found.push_back(std::move(*q));
  }
  return found;
}

}  // namespace cellcal::calib
