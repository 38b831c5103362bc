#include "sim/cell/physical_cell.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cellcal::sim {

namespace {

/// A torch's slim end between the tip and here may only be in contact; beyond it is the neck.
constexpr double kTipLengthM = 0.06;
constexpr double kNeckRadiusM = 0.012;

double distance(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d ab = b - a;
  const double t = std::clamp((p - a).dot(ab) / std::max(ab.squaredNorm(), 1e-18), 0.0, 1.0);
  return (p - a - t * ab).norm();
}

/// Thickness of the plate; a deeper tip comes from the other side.
constexpr double kPlateM = 0.03;

/// Distance of a point from the plate, negative inside.
double outside_m(const TrueFace& face, const Eigen::Vector3d& p) {
  const double above = face.normal.dot(p - face.middle_m);
  const double aside =
      (p - face.middle_m - above * face.normal).norm() - face.reach_m;  // beyond its rim
  const double beyond = std::max(above, -kPlateM - above);
  if (aside <= 0.0 || beyond <= 0.0) return std::max(aside, beyond);
  return std::hypot(aside, beyond);
}

constexpr double kLeastKgPerM = 25.0, kMostKgPerM = 60.0;
constexpr double kBesideM = 0.04;

}  // namespace

/// A controller may have more axes than carry the tip.
std::span<const double> PhysicalCell::own(std::span<const double> joint_rad) const {
  return joint_rad.first(truth_.arm.robot().joints.size());
}

calib::PreparedPose PhysicalCell::prepared(std::span<const double> joint_rad,
                                           std::size_t carriers) const {
  const auto others = joint_rad.subspan(own(joint_rad).size());
  const auto positioner =
      others.first(std::min(others.size(), truth_.arm.robot().positioner.size()));
  return truth_.arm.prepare(own(joint_rad), 0, truth_.held ? &*truth_.held : nullptr,
                            positioner.first(carriers), positioner.subspan(carriers));
}

/// The arm seen from the base and from an axis of the positioner is one body: this gives the axis' frame.
std::vector<Eigen::Vector3d> PhysicalCell::centres_m(std::span<const double> joint_rad) const {
  std::vector<Eigen::Vector3d> centres = truth_.centre_m;
  const auto flange = [&](std::size_t carriers) {
    return truth_.arm.shape(prepared(joint_rad, carriers), truth_.errors.data()).flange;
  };
  for (std::size_t axes = 1; axes <= truth_.arm.robot().positioner.size(); ++axes) {
    const Eigen::Isometry3d carried = flange(0) * flange(axes).inverse();
    for (std::size_t i = 0; i < centres.size(); ++i)
      if (truth_.carried_by[i] == static_cast<int>(axes)) centres[i] = carried * centres[i];
  }
  return centres;
}

Eigen::Vector3d PhysicalCell::tip_m(std::span<const double> joint_rad, double warm) const {
  calib::ArmChain chain;
  truth_.arm.walk(prepared(joint_rad), truth_.arm.errors(truth_.errors.data()), chain);
  return chain.tip + grown_m(chain.flange_origin, warm);
}

/// With uniform growth of all lengths the flange moves away from the base without rotation.
Eigen::Vector3d PhysicalCell::grown_m(const Eigen::Vector3d& flange, double warm) const {
  return truth_.growth * warm * flange;
}

double PhysicalCell::gap_m(std::span<const double> joint_rad, double warm) const {
  const Eigen::Vector3d tip = tip_m(joint_rad, warm);
  const std::vector<Eigen::Vector3d> centres = centres_m(joint_rad);
  double gap = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < centres.size(); ++i)
    if (truth_.radius_m[i] > 0.0)
      gap = std::min(gap, (tip - centres[i]).norm() - truth_.radius_m[i]);
  for (const TrueFace& face : truth_.faces)
    gap = std::min(gap, outside_m(face, tip) - face.tip_radius_m);
  return gap;
}

double PhysicalCell::shaft_depth_m(std::span<const double> joint_rad, double warm) const {
  const calib::ArmShape shape = truth_.arm.shape(prepared(joint_rad), truth_.errors.data());
  const Eigen::Vector3d grown = grown_m(shape.flange.translation(), warm);
  const Eigen::Vector3d tip = shape.tcp.translation() + grown;
  const Eigen::Vector3d flange = shape.flange.translation() + grown;
  const double length = (flange - tip).norm();
  if (length <= kTipLengthM) return 0.0;
  const Eigen::Vector3d neck = tip + (flange - tip) * (kTipLengthM / length);
  const std::vector<Eigen::Vector3d> centres = centres_m(joint_rad);
  double depth = 0.0;
  for (std::size_t i = 0; i < centres.size(); ++i)
    if (truth_.radius_m[i] > 0.0)
      depth =
          std::max(depth, truth_.radius_m[i] + kNeckRadiusM - distance(centres[i], neck, flange));
  // The point of a straight shaft nearest to a plate outside of it is one of its ends.
  for (const TrueFace& face : truth_.faces)
    for (const Eigen::Vector3d& end : {neck, flange})
      depth = std::max(depth, kNeckRadiusM - outside_m(face, end));
  return depth;
}

void assign_masses(calib::Robot& robot, calib::Random& random) {
  if (std::any_of(robot.joints.begin(), robot.joints.end(),
                  [](const calib::Joint& joint) { return joint.mass_kg > 0.0; }))
    return;
  for (std::size_t i = robot.first_turning() + 1; i < robot.joints.size(); ++i) {
    calib::Joint& joint = robot.joints[i];
    joint.mass_kg = std::hypot(joint.a_m, joint.d_m) * random.uniform(kLeastKgPerM, kMostKgPerM);
    // From the frame after the link back to the preceding joint.
    const Eigen::Matrix3d turn = (Eigen::AngleAxisd(joint.alpha_rad, Eigen::Vector3d::UnitX()) *
                                  Eigen::AngleAxisd(joint.beta_rad, Eigen::Vector3d::UnitY()))
                                     .toRotationMatrix();
    const Eigen::Vector3d back = turn.transpose() * Eigen::Vector3d(-joint.a_m, 0.0, -joint.d_m);
    joint.com_m = random.uniform(0.2, 0.8) * back;
    for (double& component : joint.com_m) component += random.uniform(-kBesideM, kBesideM);
  }
}

void ContactWatch::update(drivers::TimePoint from, drivers::TimePoint to, const AnglesAt& angles) {
  if (!power_on_) power_on_ = from;
  const double warm =
      cell_.truth().warm_at(std::chrono::duration<double>(from - *power_on_).count());
  const std::vector<double> end = angles(to);
  const double gap = cell_.gap_m(end, warm);
  // The shaft can only be close if the tip is; saves the second check in transits.
  constexpr double kNearM = 0.2;
  if (gap < kNearM) {
    const bool inside = cell_.shaft_depth_m(end, warm) > 0.0;
    if (inside && !crashed_) ++crashes_;
    crashed_ = inside;
  }
  deepest_m_ = std::max(deepest_m_, -gap);
  const double closes_at = early_.closing_gap_m();
  const bool closed = gap <= closes_at;
  early_.update(gap, closed);
  if (closed == closed_) return;
  drivers::TimePoint before = from, after = to;
  constexpr drivers::Duration kResolution = std::chrono::nanoseconds(100);
  while (after - before > kResolution) {
    const drivers::TimePoint middle = before + (after - before) / 2;
    ((cell_.gap_m(angles(middle), warm) <= closes_at) == closed ? after : before) = middle;
  }
  closed_ = closed;
  on_edge_(after, closed);
}

}  // namespace cellcal::sim
