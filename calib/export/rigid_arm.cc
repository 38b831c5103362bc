#include "calib/export/rigid_arm.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "calib/estimate/external_axes.h"
#include "calib/estimate/predict.h"
#include "calib/estimate/region.h"
#include "calib/model/error.h"
#include "calib/model/kinematics.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

ArmModel model_of(const RigidArm& arm) {
  Tool tool;
  tool.tcp = arm.tcp;
  return {arm.robot, tool};
}

/// Correction of a parameter that is identified as a deviation.
double deviation(const Calibration& c, const ParameterKey& key) {
  const ParameterResult* found = find(c, key);
  return found == nullptr ? 0.0 : found->nominal + found->correction;
}

/// Puts the direction of travel into the guide: its carriage is at its place in the middle.
void turn_unit(const Calibration& c, Robot& robot) {
  const auto slope = [&](GuideMotion motion) {
    return correction_of(c, guide_parameter(0, motion, 0));
  };
  Joint& unit = robot.joints.front();
  const Eigen::Matrix3d axes = guide_axes(robot);
  const Eigen::Vector3d drawn = axes.col(0);
  const Eigen::Vector3d found =
      (axes * Eigen::Vector3d(1.0 + slope(GuideMotion::kAlong), slope(GuideMotion::kAcross),
                              slope(GuideMotion::kAbove)))
          .normalized();
  robot.base_fixed.translate((drawn - found) * ((unit.min_rad + unit.max_rad) / 2.0));
  unit.guide->along = found;
}

/// Changes by the errors of geometry, kTheta to kBeta.
constexpr double Joint::*kLinkErrors[] = {&Joint::offset_rad, &Joint::d_m, &Joint::a_m,
                                          &Joint::alpha_rad, &Joint::beta_rad};

constexpr int kPoses = 1000;
constexpr unsigned kSeed = 1;

/// Over poses of the workspace, in the mean and at most.
template <typename Apart>
OmittedEffects over_workspace(const ArmModel& model, const Apart& apart_m) {
  OmittedEffects result;
  const auto poses = workspace_poses(model, kPoses, kSeed);
  for (const JointVector& q : poses) {
    const double off_m = apart_m(q);
    result.mean_m += off_m / static_cast<double>(poses.size());
    result.max_m = std::max(result.max_m, off_m);
  }
  return result;
}

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Translation3d;
using Eigen::Vector3d;

/// Frames at zero angles: before each joint, and after the last.
std::vector<Isometry3d> frames_before(const Robot& robot) {
  std::vector<Isometry3d> frames{robot.base_fixed};
  for (const Joint& joint : robot.joints) frames.push_back(frames.back() * behind(joint));
  return frames;
}

constexpr double kSameM = 1e-5;                 // rounding of data sheets
constexpr double kSameRad = 5e-3 * kRadPerDeg;  // 1.5708 for a right angle is 2e-4 deg off

constexpr double kParallelRad = 1.0 * kRadPerDeg;
constexpr double kNothingM = 1e-9;
constexpr double kNothingRad = 1e-9;

/// A joint axis at zero angle, base frame.
struct Line {
  Vector3d point, z;
  int sign;  ///< -1: the joint turns about -z
};

Line line_of(const Isometry3d& frame, const Vector3d& axis) {
  Line line{frame.translation(), (frame.linear() * axis).normalized(), 1};
  // Slightly larger weights of y and z break ties at 45 deg independently of rounding.
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

/// Angle from x of `frame` to the direction, about its z.
double angle_about_z(const Isometry3d& frame, const Vector3d& direction) {
  const Vector3d local = frame.linear().transpose() * direction;
  return std::atan2(local.y(), local.x());
}

/// DH parameters to the next axis by the common normal: theta, d, a, alpha.
void by_normal(const Isometry3d& at, const Line& next, Joint& joint) {
  const Vector3d z = at.linear().col(2);
  const Vector3d between = next.point - at.translation();
  Vector3d x = z.cross(next.z);
  const double sine = x.norm();
  x /= sine;
  // Foot of the common normal along this axis, and its length along x.
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

/// To a nearly parallel axis: its point in the plane across this axis, so that d is zero.
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

/// To the flange, within the freedom of theta, d and a.
void to_flange(const Isometry3d& at, const Isometry3d& flange, Joint& joint) {
  const Isometry3d rest = at.inverse() * flange;
  joint.d_m = tidy(rest.translation().z(), kNothingM);
  joint.errors = {JointError::kTheta, JointError::kD, JointError::kA, JointError::kAlpha};
  if (rest.linear()(2, 2) > 0.0 && rest.linear().col(2).head<2>().norm() < kParallelRad)
    joint.offset_rad = tidy(std::atan2(rest.linear()(1, 0), rest.linear()(0, 0)), kNothingRad);
}

/// First frame: origin at the point of the first axis nearest to the base's origin; x as close to
/// the base's as possible.
Isometry3d first_frame(const Line& line) {
  Isometry3d frame = Isometry3d::Identity();
  frame.translation() = line.point - line.z * line.z.dot(line.point);
  const Vector3d along = std::abs(line.z.x()) < 0.9 ? Vector3d::UnitX() : Vector3d::UnitY();
  const Vector3d x = (along - line.z * line.z.dot(along)).normalized();
  frame.linear() << x, line.z.cross(x), line.z;
  return frame;
}

/// Sets entries at rounding level to zero.
Isometry3d tidy(Isometry3d frame) {
  if (frame.isApprox(Isometry3d::Identity(), kNothingM)) return Isometry3d::Identity();
  return frame;
}

constexpr double kSameZeroRad = 0.01 * kRadPerDeg;
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
           off_m +
               aside({turned.translation(), turned.linear() * other_.joints[i + 1].axis}, i + 1));
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
    found_.flange_rad = Eigen::Quaterniond(AngleAxisd(-angle, axis) * wanted)
                            .angularDistance(Eigen::Quaterniond::Identity());
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

RigidArm nominal_rigid_arm(const Cell& cell) { return {cell.robot, cell.tool.tcp}; }

RigidArm calibrated_rigid_arm(const Calibration& calibration) {
  RigidArm arm = nominal_rigid_arm(calibration.cell);
  if (arm.robot.first_turning() > 0) turn_unit(calibration, arm.robot);
  for (std::size_t i = 0; i < arm.robot.joints.size(); ++i)
    for (std::size_t k = 0; k < std::size(kLinkErrors); ++k)
      arm.robot.joints[i].*kLinkErrors[k] +=
          deviation(calibration, joint_parameter(static_cast<ParameterKind>(k), i));
  for (std::size_t j = 0; j < arm.robot.positioner.size(); ++j)
    arm.robot.positioner[j].frame = axis_as_found(calibration, j);
  for (int axis = 0; axis < 3; ++axis)
    arm.tcp.translation()[axis] +=
        deviation(calibration, tool_parameter(ParameterKind::kTcp, 0, axis));
  return arm;
}

RigidPose pose_of(const RigidArm& arm, const std::vector<double>& joint_rad) {
  const ArmModel model = model_of(arm);
  const ArmShape shape = model.shape(model.prepare(joint_rad), nullptr);
  return {shape.flange, shape.tcp};
}

RigidArm nearest_rigid_arm(const Calibration& calibration) {
  constexpr int kPasses = 3;
  constexpr double kLeverM = 0.2;   // at which a turn of the TCP counts as a shift
  constexpr double kSigmaM = 1e-4;  // against the tolerances, for what the poses do not tell apart
  RigidArm arm = calibrated_rigid_arm(calibration);
  const Predictor whole(calibration);
  for (int pass = 0; pass < kPasses; ++pass) {
    const ArmModel model = model_of(arm);
    const std::vector<ArmParameter>& all = model.parameters();
    // The errors of geometry are the first.
    const auto count = std::ranges::count_if(
        all, [](const ArmParameter& one) { return one.kind <= ParameterKind::kBeta; });
    if (count == 0) break;  // all as exact as drawn
    Eigen::MatrixXd information = Eigen::MatrixXd::Zero(count, count);
    Eigen::VectorXd towards = Eigen::VectorXd::Zero(count);
    for (Eigen::Index k = 0; k < count; ++k)
      information(k, k) = kPoses * std::pow(kSigmaM / all[static_cast<std::size_t>(k)].sigma, 2);
    const ArmErrors none = model.errors(nullptr);
    Eigen::Matrix3Xd moves(3, model.size()), turns(3, model.size());
    for (const JointVector& q : workspace_poses(model, kPoses, kSeed)) {
      const PreparedPose pose = model.prepare(q);
      ArmChain chain;
      model.walk(pose, none, chain);
      model.derivative(pose, none, chain, moves);
      model.turn_derivative(pose, none, chain, turns);
      const Eigen::Isometry3d wanted = whole.calibrated(q).tcp;
      const Eigen::AngleAxisd turn(wanted.linear() * model.rotation(pose, none, chain).transpose());
      const auto by_move = moves.leftCols(count), by_turn = turns.leftCols(count);
      information +=
          by_move.transpose() * by_move + kLeverM * kLeverM * by_turn.transpose() * by_turn;
      towards += by_move.transpose() * (wanted.translation() - chain.tip) +
                 kLeverM * kLeverM * turn.angle() * by_turn.transpose() * turn.axis();
    }
    const Eigen::VectorXd change = information.ldlt().solve(towards);
    for (Eigen::Index k = 0; k < count; ++k) {
      const ParameterKey& key = all[static_cast<std::size_t>(k)];
      arm.robot.joints[static_cast<std::size_t>(key.joint)].*
          kLinkErrors[static_cast<std::size_t>(key.kind)] += change[k];
    }
  }
  return arm;
}

OmittedEffects left_out(const Calibration& calibration, const RigidArm& rigid) {
  const ArmModel model = model_of(rigid);
  const Predictor whole(calibration);
  return over_workspace(model, [&](const JointVector& q) {
    return (whole.calibrated(q).tcp.translation() - model.nominal_tip_m(q)).norm();
  });
}

OmittedEffects left_out_of_unit(const Calibration& calibration, bool with_direction) {
  Calibration rigid = calibration;
  if (rigid.cell.robot.first_turning() == 0) return {};
  if (with_direction) turn_unit(calibration, rigid.cell.robot);
  for (ParameterResult& one : rigid.parameters)
    if (one.key.kind == ParameterKind::kGuide) one.correction = 0.0;
  const ArmModel whole(at_level(calibration.cell, calibration.level)),
      less(at_level(rigid.cell, rigid.level));
  const Eigen::VectorXd x = arm_values(whole, calibration), y = arm_values(less, rigid);
  return over_workspace(whole, [&](const JointVector& q) {
    return (whole.position(whole.prepare(q), x.data()) - less.position(less.prepare(q), y.data()))
        .norm();
  });
}

Isometry3d behind(const Joint& joint) {
  return AngleAxisd(joint.offset_rad, Vector3d::UnitZ()) *
         Translation3d(joint.a_m, 0.0, joint.d_m) * AngleAxisd(joint.alpha_rad, Vector3d::UnitX()) *
         AngleAxisd(joint.beta_rad, Vector3d::UnitY());
}

JointFrames joint_frames(const RigidArm& arm) {
  JointFrames frames;
  Isometry3d before = arm.robot.base_fixed;
  for (const Joint& joint : arm.robot.joints) {
    PlacedJoint& one = frames.joints.emplace_back();
    one.name = joint.name;
    one.origin = before;
    one.axis = joint.sign * Vector3d::UnitZ();
    one.slides = joint.is_prismatic();
    const Isometry3d axes(one.slides ? guide_axes(arm.robot) : Eigen::Matrix3d::Identity());
    if (one.slides) {
      one.origin = before * axes;
      one.axis = Vector3d::UnitX();
    }
    one.min_rad = joint.min_rad;
    one.max_rad = joint.max_rad;
    one.max_speed_rad_s = joint.max_speed_rad_s;
    one.mass_kg = joint.mass_kg;
    before = axes.inverse() * behind(joint);
    one.com_m = joint.mass_kg > 0.0 ? Vector3d(before * joint.com_m) : Vector3d::Zero();
  }
  frames.flange = before * arm.robot.flange_fixed;
  frames.tcp = arm.tcp;
  for (const PositionerAxis& axis : arm.robot.positioner) {
    PlacedJoint& one = frames.positioner.emplace_back();
    one.name = axis.name;
    one.origin = axis.frame;
    one.axis = axis.sign * Vector3d::UnitZ();
    one.min_rad = axis.min_rad;
    one.max_rad = axis.max_rad;
  }
  return frames;
}

JointFrames moved_frames(const JointFrames& given, const RigidArm& nominal,
                         const RigidArm& calibrated) {
  const std::size_t joints = nominal.robot.joints.size();
  const bool slides = !given.joints.empty() && given.joints.front().slides;
  if (slides != (nominal.robot.first_turning() > 0))
    throw FileError(
        slides ? fmt::format("joint \"{}\" slides, and the calibrated robot is on no linear unit",
                             given.joints.front().name)
               : fmt::format("no prismatic joint carries its arm, and {} carries the calibrated "
                             "robot. Add it before the arm, or leave --urdf out",
                             nominal.robot.joints.front().name));
  if (given.joints.size() != joints)
    throw FileError(fmt::format("{} joints turn in its chain, {} in the calibrated robot",
                                given.joints.size(), joints));
  const std::vector<Isometry3d> before = frames_before(nominal.robot);
  JointFrames moved = given;
  moved.positioner = joint_frames(calibrated).positioner;
  Isometry3d link = Isometry3d::Identity();  // the given frame before the joint, at zero angles
  Isometry3d fixed = calibrated.robot.base_fixed;  // from the preceding moved frame to the joint's
  for (std::size_t i = 0; i < joints; ++i) {
    const PlacedJoint& one = given.joints[i];
    const Joint& joint = nominal.robot.joints[i];
    link = link * one.origin;
    Isometry3d on_axis = before[i].inverse() * link;  // place_i
    const Vector3d z = joint.is_prismatic() ? joint.guide->along : Vector3d::UnitZ();
    const double off_m = joint.is_prismatic() ? 0.0 : on_axis.translation().head<2>().norm();
    const Vector3d axis = on_axis.linear() * one.axis * joint.sign;
    const double off_rad = std::atan2(axis.cross(z).norm(), axis.dot(z));
    if (!(off_m <= kSameM) || !(off_rad <= kSameRad))
      throw FileError(fmt::format(
          "joint \"{}\": its axis is {:.3f} mm and {:.4f} deg off the axis of {} in the nominal "
          "robot \"{}\" (limits {:.2f} mm, {:.3f} deg). Use the URDF of this robot type, with the controller's zero "
          "and senses of rotation",
          one.name, off_m * kMmPerM, off_rad * kDegPerRad, joint.name, nominal.robot.name,
          kSameM * kMmPerM, kSameRad * kDegPerRad));
    Isometry3d turn = Isometry3d::Identity();
    if (joint.is_prismatic())
      turn = Eigen::Quaterniond::FromTwoVectors(z, calibrated.robot.joints[i].guide->along);
    else
      on_axis.translation().head<2>().setZero();  // removes rounding off the axis
    moved.joints[i].origin = fixed * turn * on_axis;
    // The joint turns about its own z before place_i: set exactly, without the rounding of the
    // given axis.
    moved.joints[i].axis = joint.sign * (on_axis.linear().transpose() * z);
    fixed = (turn * on_axis).inverse() * behind(calibrated.robot.joints[i]);
  }
  // A flange of the given URDF that coincides with the nominal robot's stays on the calibrated
  // one's.
  const Isometry3d offset =
      (before.back() * nominal.robot.flange_fixed).inverse() * (link * given.flange);
  moved.flange = fixed * calibrated.robot.flange_fixed * offset;
  return moved;
}

Isometry3d flange_of(const JointFrames& frames, const std::vector<double>& joint_rad) {
  Isometry3d at = Isometry3d::Identity();
  for (std::size_t i = 0; i < frames.joints.size(); ++i) {
    const PlacedJoint& one = frames.joints[i];
    at = at * one.origin;
    if (one.slides)
      at.translate(joint_rad.at(i) * one.axis);
    else
      at.rotate(AngleAxisd(joint_rad.at(i), one.axis));
  }
  return at * frames.flange;
}

Vector3d roll_pitch_yaw(const Eigen::Matrix3d& r) {
  // Sequential, each on the remainder of the one before: accurate to rounding also near pitch +-90
  // deg.
  constexpr double kGimbal = 1e-12;
  const double yaw = std::hypot(r(0, 0), r(1, 0)) < kGimbal ? 0.0 : std::atan2(r(1, 0), r(0, 0));
  const Eigen::Matrix3d rest = AngleAxisd(-yaw, Vector3d::UnitZ()) * r;
  return {std::atan2(-rest(1, 2), rest(1, 1)), std::atan2(-rest(2, 0), rest(0, 0)), yaw};
}

Eigen::Matrix3d rotation_of(const Vector3d& rpy) {
  return (AngleAxisd(rpy[2], Vector3d::UnitZ()) * AngleAxisd(rpy[1], Vector3d::UnitY()) *
          AngleAxisd(rpy[0], Vector3d::UnitX()))
      .toRotationMatrix();
}

Robot robot_of(const JointFrames& frames) {
  std::vector<Line> lines;
  std::vector<Isometry3d> links;  // after each joint, at zero angles
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

bool JointZero::same() const { return sense > 0 && std::abs(zero_rad) < kSameZeroRad; }

bool ZeroComparison::same() const {
  return flange_rad < kSameZeroRad && std::ranges::all_of(joints, &JointZero::same);
}

std::optional<ZeroComparison> compare_zeros(const JointFrames& arm, const JointFrames& other) {
  constexpr std::size_t kMostJoints = 12;  // up to two explanations for each
  if (arm.joints.size() != other.joints.size() || arm.joints.empty() ||
      arm.joints.size() > kMostJoints)
    return std::nullopt;
  return Search(arm, other).best();
}

}  // namespace cellcal::calib
