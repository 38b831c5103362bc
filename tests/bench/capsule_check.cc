#include "tests/bench/capsule_check.h"

#include <algorithm>
#include <cmath>

namespace cellcal::calib {

namespace {

using Eigen::Vector3d;

constexpr double kLinkRadiusM = 0.10;  // forearm castings of 5 to 20 kg arms
constexpr double kToolRadiusM = 0.03;  // a torch's neck
constexpr double kTipLengthM = 0.06;   // slim end of the tool: contact tip and wire
constexpr double kTipRadiusM = 0.004;
constexpr double kBodyMarginM = 0.02;  // for everything except the tip
constexpr double kTipMargin =
    0.011;  // of the tip's end from every sphere's surface, as Clearance has it
constexpr double kStandRadiusM = 0.015;
constexpr double kStandLengthM = 0.25;
constexpr double kBelowTargetsM = 0.10;  // wrist and flange stay above the lowest target minus this
constexpr double kStepRad = 0.02;        // 2.8 cm at 1.4 m, less than any radius here with margin

double distance(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d ab = b - a;
  const double t = std::clamp((p - a).dot(ab) / std::max(ab.squaredNorm(), 1e-18), 0.0, 1.0);
  return (p - a - t * ab).norm();
}

/// Closest distance of two segments (Ericson, Real-Time Collision Detection, 5.1.9).
double distance(const Vector3d& p1, const Vector3d& q1, const Vector3d& p2, const Vector3d& q2) {
  const Vector3d d1 = q1 - p1, d2 = q2 - p2, r = p1 - p2;
  const double a = std::max(d1.squaredNorm(), 1e-18), e = std::max(d2.squaredNorm(), 1e-18);
  const double b = d1.dot(d2), c = d1.dot(r), f = d2.dot(r), denominator = a * e - b * b;
  double s = denominator > 1e-18 ? std::clamp((b * f - c * e) / denominator, 0.0, 1.0) : 0.0;
  double t = (b * s + f) / e;
  if (t < 0.0 || t > 1.0) {
    t = std::clamp(t, 0.0, 1.0);
    s = std::clamp((b * t - c) / a, 0.0, 1.0);
  }
  return (p1 + s * d1 - p2 - t * d2).norm();
}

}  // namespace

CapsuleCheck::CapsuleCheck(const Cell& cell, const ArmModel& arm) : arm_(arm) {
  up_ = -cell.robot.gravity_m_s2.normalized();
  if (!up_.allFinite()) up_ = Vector3d::UnitZ();
  floor_m_ = 1e9;
  for (const Target& target : cell.targets) {
    // Trackers, planes and targets without a stated centre are no obstacles.
    if (!has_a_centre(target.kind) || !target.has_centre) continue;
    const double radius = target.diameter_m / 2.0;
    obstacles_.push_back(
        {target.centre_m, target.centre_m - (radius + kStandLengthM) * up_, radius});
    floor_m_ = std::min(floor_m_, target.centre_m.dot(up_) - kBelowTargetsM);
  }
}

bool CapsuleCheck::clear(const JointVector& q) const {
  const ArmShape shape = arm_.shape(arm_.prepare(q), nullptr);
  const Vector3d tip = shape.tcp.translation(), flange = shape.flange.translation();
  const double length = (tip - flange).norm();
  const Vector3d neck =
      length > kTipLengthM ? Vector3d(tip + (flange - tip) * (kTipLengthM / length)) : flange;
  const auto& origins = shape.joint_origin_m;
  if (flange.dot(up_) < floor_m_) return false;
  if (origins.size() >= 3 && origins[origins.size() - 3].dot(up_) < floor_m_) return false;
  for (const Obstacle& o : obstacles_) {
    const auto gap = [&](const Vector3d& a, const Vector3d& b, double radius) {
      return std::min(distance(o.centre_m, a, b) - o.radius_m,
                      distance(o.centre_m, o.foot_m, a, b) - kStandRadiusM) -
             radius;
    };
    if (distance(o.centre_m, tip, neck) - o.radius_m < kTipMargin) return false;
    if (distance(o.centre_m, o.foot_m, tip, neck) - kStandRadiusM - kTipRadiusM < kTipMargin)
      return false;
    if (gap(neck, flange, kToolRadiusM) < kBodyMarginM) return false;
    // The column of the base is fixed; links from the shoulder on move.
    for (std::size_t i = 2; i < origins.size(); ++i)
      if (gap(origins[i - 1], origins[i], kLinkRadiusM) < kBodyMarginM) return false;
  }
  return true;
}

bool CapsuleCheck::clear(const JointVector& from, const JointVector& to) const {
  double largest = 0.0;
  for (std::size_t i = 0; i < from.size(); ++i)
    largest = std::max(largest, std::abs(to[i] - from[i]));
  const int steps = std::max(1, static_cast<int>(std::ceil(largest / kStepRad)));
  JointVector q(from.size());
  for (int k = 0; k <= steps; ++k) {
    const double s = static_cast<double>(k) / steps;
    for (std::size_t i = 0; i < q.size(); ++i) q[i] = from[i] + s * (to[i] - from[i]);
    if (!clear(q)) return false;
  }
  return true;
}

}  // namespace cellcal::calib
