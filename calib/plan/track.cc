#include "calib/plan/track.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/plan/pool.h"

namespace cellcal::calib {

namespace {

/// Upper bound of the distance from the arm's foot to the TCP.
double stretched_m(const ArmModel& arm) {
  double sum = arm.robot().flange_fixed.translation().norm() + arm.tool().tcp.translation().norm();
  for (const Joint& joint : arm.robot().joints) sum += std::hypot(joint.d_m, joint.a_m);
  return sum;
}

constexpr double kArmSigmas = 4.0;  ///< of the difference between two postures, (64c)

/// In the worst direction, in the middle posture.
double off_by_arm_m(const Cell& cell) {
  constexpr double kMostM = 0.025;
  const ArmModel arm(cell.robot, cell.tool);
  const PreparedPose pose = arm.prepare(middle_posture(cell.robot));
  const ArmErrors none = arm.errors(nullptr);
  ArmChain chain;
  arm.walk(pose, none, chain);
  Eigen::VectorXd along(arm.size());
  double most_m2 = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    arm.derivative_along(Eigen::Vector3d::Unit(axis), pose, none, chain, along.data());
    double sum_m2 = 0.0;
    for (int k = 0; k < arm.size(); ++k)
      if (const ArmParameter& error = arm.parameters()[k]; error.kind <= ParameterKind::kBeta)
        sum_m2 += std::pow(along[k] * error.sigma, 2);
    most_m2 = std::max(most_m2, sum_m2);
  }
  return std::min(kArmSigmas * std::sqrt(2.0 * most_m2), kMostM);  // (64c)
}

}  // namespace

double track_position_m(const ArmModel& arm, const Eigen::Vector3d& place_m, double margin_m,
                        Random& random) {
  const Robot& robot = arm.robot();
  if (robot.first_turning() == 0) return 0.0;
  const Joint& track = robot.joints[0];
  margin_m = std::min(margin_m, (track.max_rad - track.min_rad) / 4.0);
  const double least = track.min_rad + margin_m, most = track.max_rad - margin_m;
  const Eigen::Vector3d along = robot.base_fixed.linear() * track.guide->along;
  const Eigen::Vector3d off = place_m - robot.base_fixed.translation();
  const double opposite = along.dot(off), beside = (off - opposite * along).norm();
  const double stretched = stretched_m(arm);
  const double half = beside < stretched ? std::sqrt(stretched * stretched - beside * beside) : 0.0;
  const double low = std::clamp(opposite - half, least, most),
               high = std::clamp(opposite + half, least, most);
  return random.uniform(low, high);
}

TrackOff::TrackOff(const Robot& robot)
    : along_(Eigen::Vector3d::Zero()), foot_m_(robot.base_fixed.translation()) {
  if (robot.first_turning() == 0) return;
  const Joint& track = robot.joints[0];
  guide_ = track.guide;
  along_ = robot.base_fixed.linear() * guide_->along;
  min_m_ = track.min_rad;
  max_m_ = track.max_rad;
}

TrackOff::Place TrackOff::place(const Eigen::Vector3d& place_m) const {
  const double opposite = std::clamp(along_.dot(place_m - foot_m_), min_m_, max_m_);
  return {opposite, (place_m - foot_m_ - opposite * along_).norm()};
}

double TrackOff::off_m(const Place& place, double carriage_m) const {
  constexpr double kSigmas = 3.0;
  const double way = carriage_m - place.opposite_m, lever = std::hypot(place.beside_m, way);
  const double shift = std::max(guide_->scale_sigma, guide_->direction_sigma_rad);
  const double slope = std::hypot(shift, guide_->turn_sigma_rad_m * lever);
  const double waves = std::hypot(guide_->straightness_sigma_m, guide_->turn_sigma_rad * lever);
  return kSigmas * std::sqrt(way * way * slope * slope + 2.0 * waves * waves);  // (64a)
}

double TrackOff::widened_m(double usual_m, const Eigen::Vector3d& place_m,
                           const JointVector& q) const {
  return any() ? std::hypot(usual_m, off_m(place(place_m), q[0])) : usual_m;
}

PlanOptions with_tolerances(PlanOptions options, const Cell& cell) {
  constexpr double kUsuallyOffM = 0.015;  // of arms up to some 2.2 m of reach
  if (const double off_m = off_by_arm_m(cell); off_m > kUsuallyOffM) options.arm_off_m = off_m;
  return options;
}

double arm_sigma_m(const Cell& cell) {
  return std::max(kLeastArmSigmaM,
                  with_tolerances({}, cell).arm_off_m / (kArmSigmas * std::numbers::sqrt2));
}

SearchReach search_reach(const TrackOff& unit, const Target& target, const JointVector& contact,
                         const PlanOptions& options) {
  const auto widened_m = [&](double usual_m) {
    return std::hypot(unit.widened_m(usual_m, target.centre_m, contact), target.off_m);
  };
  const auto by_arm_m = [&](double usual_m) { return std::hypot(usual_m, options.arm_off_m); };
  const double before_m = by_arm_m(widened_m(options.standoff_m)),
               within_m = widened_m(options.beyond_m);
  return {before_m, by_arm_m(within_m), options.clear_m + (before_m - options.standoff_m),
          within_m};
}

}  // namespace cellcal::calib
