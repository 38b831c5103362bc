#include "calib/export/joint_zeros.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kSameRad = 0.01 * kRadPerDeg;
/// Axes that differ by more are those of different arms.
constexpr double kOtherAxis = 0.02;
/// Less from its neighbour's line an axis gives no direction.
constexpr double kShortestM = 1e-3;
/// Decides between equal explanations alone.
constexpr double kWeightOfDifferences = 1e-4;
/// A turned flange counts as an axis so much aside.
constexpr double kFlangeM = 0.5;

struct Axis {
  Vector3d point, direction;
};

/// At zero angles, in the base frame.
std::vector<Axis> axes_of(const JointFrames& arm) {
  std::vector<Axis> axes;
  Isometry3d at = Isometry3d::Identity();
  for (const PlacedJoint& joint : arm.joints) {
    at = at * joint.origin;
    axes.push_back({at.translation(), at.linear() * joint.axis});
  }
  return axes;
}

/// From a to b about the unit axis.
double angle_about(const Vector3d& axis, const Vector3d& a, const Vector3d& b) {
  return std::atan2(axis.dot(a.cross(b)), a.dot(b) - axis.dot(a) * axis.dot(b));
}

/// The other arm is brought onto the axes of the first, joint by joint.
class Search {
 public:
  Search(const JointFrames& arm, const JointFrames& other)
      : other_(other), axes_(axes_of(arm)), flange_(flange_of(arm, zeros(arm))) {}

  std::optional<ZeroComparison> best() {
    const Axis first{other_.joints[0].origin.translation(),
                     other_.joints[0].origin.linear() * other_.joints[0].axis};
    found_.joints.resize(axes_.size());
    const double along = first.direction.dot(axes_[0].direction);
    if (std::abs(along) < 1.0 - kOtherAxis) return std::nullopt;
    found_.joints[0].sense = along > 0.0 ? 1 : -1;
    turn(0, other_.joints[0].origin, aside(first, 0));
    return best_;
  }

 private:
  static std::vector<double> zeros(const JointFrames& arm) {
    return std::vector<double>(arm.joints.size(), 0.0);
  }

  double aside(const Axis& axis, std::size_t of) const {
    return (axis.point - axes_[of].point).cross(axes_[of].direction).norm();
  }

  /// Tries the angles of joint i, whose frame is `at` before it turns.
  void turn(std::size_t i, const Isometry3d& at, double off_m) {
    if (i + 1 == axes_.size()) return end(at, off_m);
    const Vector3d& axis = other_.joints[i].axis;
    const Isometry3d& next = other_.joints[i + 1].origin;
    const Vector3d direction = next.linear() * other_.joints[i + 1].axis;
    const Vector3d wanted = at.linear().transpose() * axes_[i + 1].direction;
    const Vector3d place = at.inverse() * axes_[i + 1].point;
    const bool parallel = direction.cross(axis).norm() < kOtherAxis;
    for (const int sense : {1, -1}) {
      if (std::abs(direction.dot(axis) - sense * wanted.dot(axis)) > kOtherAxis) continue;
      double angle = parallel ? 0.0 : angle_about(axis, direction, sense * wanted);
      if (parallel && next.translation().cross(axis).norm() > kShortestM &&
          place.cross(axis).norm() > kShortestM)
        angle = angle_about(axis, next.translation(), place);
      found_.joints[i].zero_rad = angle;
      found_.joints[i + 1].sense = sense;
      const Isometry3d turned = at * Isometry3d(AngleAxisd(angle, axis)) * next;
      turn(i + 1, turned,
           off_m + aside({turned.translation(), turned.linear() * other_.joints[i + 1].axis}, i + 1));
    }
  }

  /// The last joint's zero brings the flanges together.
  void end(const Isometry3d& at, double off_m) {
    const Vector3d& axis = other_.joints.back().axis;
    const Eigen::Quaterniond wanted(at.linear().transpose() * flange_.linear() *
                                    other_.flange.linear().transpose());
    const double angle =
        std::remainder(2.0 * std::atan2(wanted.vec().dot(axis), wanted.w()), kRadPerTurn);
    found_.joints.back().zero_rad = angle;
    found_.flange_rad =
        Eigen::Quaterniond(AngleAxisd(-angle, axis) * wanted).angularDistance(
            Eigen::Quaterniond::Identity());
    found_.aside_m = off_m;
    double differences = 0.0;
    for (const JointZero& one : found_.joints)
      differences += std::abs(one.zero_rad) + (one.sense < 0 ? 1.0 : 0.0);
    const double worse = off_m + kFlangeM * found_.flange_rad + kWeightOfDifferences * differences;
    if (worse >= least_) return;
    least_ = worse;
    best_ = found_;
  }

  const JointFrames& other_;
  std::vector<Axis> axes_;
  Isometry3d flange_;
  ZeroComparison found_;
  std::optional<ZeroComparison> best_;
  double least_ = std::numeric_limits<double>::infinity();
};

}  // namespace

bool JointZero::same() const { return sense > 0 && std::abs(zero_rad) < kSameRad; }

bool ZeroComparison::same() const {
  return flange_rad < kSameRad && std::ranges::all_of(joints, &JointZero::same);
}

std::optional<ZeroComparison> compare_zeros(const JointFrames& arm, const JointFrames& other) {
  constexpr std::size_t kMostJoints = 12;  // up to two explanations for each
  if (arm.joints.size() != other.joints.size() || arm.joints.empty() ||
      arm.joints.size() > kMostJoints)
    return std::nullopt;
  return Search(arm, other).best();
}

}  // namespace cellcal::calib
