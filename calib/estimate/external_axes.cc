#include "calib/estimate/external_axes.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "calib/estimate/predict.h"
#include "calib/model/inverse.h"
#include "calib/model/linear.h"

namespace cellcal::calib {

// Linear unit.

namespace {

using Eigen::Vector3d;

constexpr double kCoverage = 2.0;
/// Intervals of the table: half a wave has two or more.
constexpr int kLeastIntervals = 12;
constexpr int kPerOrder = 2;

bool is_slope_of_shift(const ArmParameter& parameter) {
  return parameter.harmonic == 0 && is_shift(GuideMotion{parameter.axis});
}

/// d(motion)/dx at a position of the carriage, of all parameters of the unit.
Eigen::VectorXd factors_at(const ArmModel& arm, double position_m) {
  JointVector q(arm.robot().joints.size(), 0.0);
  q.front() = position_m;
  return arm.prepare(q).factor;
}

LinearUnitLine::At motion_at(const ArmModel& arm, const Eigen::VectorXd& x,
                             const Eigen::MatrixXd& covariance, double position_m) {
  LinearUnitLine::At at;
  at.position_m = position_m;
  const Eigen::VectorXd factor = factors_at(arm, position_m);
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(kGuideMotions, arm.size());
  for (int p = 0; p < arm.size(); ++p) {
    const ArmParameter& parameter = arm.parameters()[static_cast<std::size_t>(p)];
    if (parameter.kind == ParameterKind::kGuide && !is_slope_of_shift(parameter))
      rows(parameter.axis, p) = factor[p];
  }
  const Eigen::VectorXd motion = rows * x;
  for (int k = 0; k < kGuideMotions; ++k) {
    at.motion[static_cast<std::size_t>(k)] = motion[k];
    if (covariance.size() > 0)
      at.u95[static_cast<std::size_t>(k)] =
          kCoverage *
          std::sqrt(std::max(0.0, (rows.row(k) * covariance * rows.row(k).transpose()).value()));
  }
  return at;
}

/// Range of an axis' positions over the fit touches; `at`: that of a touch, if it counts.
std::optional<std::array<double, 2>> touched_range(
    std::span<const Touch> touches, const std::function<std::optional<double>(const Touch&)>& at) {
  std::optional<std::array<double, 2>> range;
  for (const Touch& touch : touches) {
    const auto one = touch.set == TouchSet::kFit ? at(touch) : std::nullopt;
    if (!one) continue;
    if (!range) range = {*one, *one};
    range = {std::min((*range)[0], *one), std::max((*range)[1], *one)};
  }
  return range;
}

/// Direction and scale by the slopes of the shifts.
void add_slopes(const Calibration& c, const ArmModel& arm, const Eigen::MatrixXd& covariance,
                LinearUnitLine& line) {
  const auto slope = [&](GuideMotion motion) {
    return correction_of(c, guide_parameter(0, motion, 0));
  };
  const Eigen::Matrix3d axes = c.cell.robot.base_fixed.linear() * guide_axes(c.cell.robot);
  const Vector3d travel(1.0 + slope(GuideMotion::kAlong), slope(GuideMotion::kAcross),
                        slope(GuideMotion::kAbove));
  line.scale = travel.norm() - 1.0;
  line.direction = axes * travel.normalized();
  if (covariance.size() == 0) return;
  Eigen::Matrix3Xd moves = Eigen::Matrix3Xd::Zero(3, arm.size());
  for (int p = 0; p < arm.size(); ++p) {
    const ArmParameter& parameter = arm.parameters()[static_cast<std::size_t>(p)];
    if (parameter.kind != ParameterKind::kGuide || !is_slope_of_shift(parameter)) continue;
    if (GuideMotion{parameter.axis} == GuideMotion::kAlong)
      line.scale_u95 = kCoverage * std::sqrt(covariance(p, p));
    else
      moves.col(p) = axes.col(parameter.axis);
  }
  const PositionBound bound(arm, arm_values(arm, c), covariance, 0.0);
  const Eigen::Matrix<double, 3, 6> turn =
      base_motion(line.direction) - base_motion(Vector3d::Zero());
  line.direction_u95_rad = radius_95(bound.covariance(moves, turn));
}

}  // namespace

Eigen::Matrix3d guide_axes(const Robot& robot) {
  const ArmModel arm(robot, Tool{});
  ArmChain chain;
  arm.walk(arm.prepare(JointVector(robot.joints.size(), 0.0)), arm.errors(nullptr), chain);
  Eigen::Matrix3d axes;
  axes << chain.link[0].x, chain.link[0].y, chain.link[0].z;
  return robot.base_fixed.linear().transpose() * axes;
}

std::vector<Eigen::Isometry3d> carriage_as_found(const Calibration& c,
                                                 std::span<const double> positions_m) {
  const ArmModel arm(at_level(c.cell, c.level));
  const Eigen::VectorXd x = arm_values(arm, c);
  const ArmErrors errors = arm.errors(x.data());
  std::vector<Eigen::Isometry3d> found;
  JointVector q(c.cell.robot.joints.size(), 0.0);
  ArmChain chain;
  for (const double position_m : positions_m) {
    q.front() = position_m;
    arm.walk(arm.prepare(q), errors, chain);
    found.emplace_back(Eigen::Translation3d(chain.link[0].end) *
                       Eigen::Quaterniond(chain.link[0].rotation));
  }
  return found;
}

std::optional<LinearUnitLine> linear_unit_line(const Calibration& c,
                                               std::span<const Touch> touches) {
  if (c.cell.robot.first_turning() == 0) return std::nullopt;
  const ArmModel arm(at_level(c.cell, c.level));
  const Eigen::VectorXd x = arm_values(arm, c);
  const Eigen::MatrixXd covariance = arm_covariance(arm, c);
  const Joint& unit = c.cell.robot.joints.front();
  LinearUnitLine line;
  line.axis = unit.name;
  line.touched_m = touched_range(touches, [](const Touch& touch) {
    return touch.joint_rad.empty() ? std::nullopt : std::optional(touch.joint_rad.front());
  });
  const double stroke_m = unit.max_rad - unit.min_rad;
  const int intervals = std::max(kLeastIntervals, kPerOrder * guide_orders(stroke_m));
  for (int k = 0; k <= intervals; ++k)
    line.at.push_back(motion_at(arm, x, covariance, unit.min_rad + stroke_m * k / intervals));
  add_slopes(c, arm, covariance, line);
  return line;
}

// Positioner.

namespace {

/// F_j with the axis' errors, and the directions of these in the base frame with all axes at 0.
struct FoundAxis {
  Eigen::Isometry3d frame, in_base;
  Vector3d along_x, along_y;
};

FoundAxis found_axis(const Calibration& c, std::size_t j, const Eigen::Isometry3d& before) {
  FoundAxis axis;
  axis.frame = axis_as_found(c, j);
  axis.in_base = before * axis.frame;
  const Eigen::Matrix3d drawn = (before * c.cell.robot.positioner[j].frame).linear();
  axis.along_x = drawn.col(0);
  axis.along_y = drawn.col(1);
  return axis;
}

/// Derivatives of a line's point and direction by the arm's parameters.
struct LineMoves {
  Eigen::Matrix3Xd point, direction;
};

/// `axes`: up to that of the line. The second tilt is about the y axis that the first has turned.
LineMoves moves_of(const ArmModel& arm, const std::vector<FoundAxis>& axes) {
  const Vector3d point = axes.back().in_base.translation(), z = axes.back().in_base.linear().col(2);
  LineMoves moves{Eigen::Matrix3Xd::Zero(3, arm.size()), Eigen::Matrix3Xd::Zero(3, arm.size())};
  for (int p = 0; p < arm.size(); ++p) {
    const ArmParameter& parameter = arm.parameters()[static_cast<std::size_t>(p)];
    const auto k = static_cast<std::size_t>(parameter.carrier);
    if (parameter.kind != ParameterKind::kPositioner || k >= axes.size()) continue;
    const AxisError error{parameter.axis};
    const FoundAxis& axis = axes[k];
    if (error == AxisError::kX || error == AxisError::kY) {
      moves.point.col(p) = error == AxisError::kX ? axis.along_x : axis.along_y;
      continue;
    }
    if (error != AxisError::kTurnX && error != AxisError::kTurnY)
      continue;  // of an angle that is 0, without a load
    const Vector3d about =
        error == AxisError::kTurnX ? axis.along_x : Vector3d(axis.in_base.linear().col(1));
    moves.point.col(p) = about.cross(point - axis.in_base.translation());
    moves.direction.col(p) = about.cross(z);
  }
  return moves;
}

/// Angle of an axis, where something that it carries is touched.
std::optional<double> carrying_rad(const Cell& cell, const Touch& touch, std::size_t axis) {
  const auto target = std::ranges::find(cell.targets, touch.target, &Target::id);
  const bool carried = target != cell.targets.end() &&
                       static_cast<int>(axis) < target->carried_by &&
                       axis < touch.positioner_rad.size();
  return carried ? std::optional(touch.positioner_rad[axis]) : std::nullopt;
}

}  // namespace

std::vector<PositionerLine> positioner_lines(const Calibration& c, std::span<const Touch> touches) {
  std::vector<PositionerLine> lines;
  if (c.cell.robot.positioner.empty()) return lines;
  const ArmModel arm(at_level(c.cell, c.level));
  const PositionBound bound(arm, arm_values(arm, c), arm_covariance(arm, c), 0.0);
  Eigen::Isometry3d before = Eigen::Isometry3d::Identity();
  std::vector<FoundAxis> axes;
  for (std::size_t j = 0; j < c.cell.robot.positioner.size(); ++j) {
    axes.push_back(found_axis(c, j, before));
    before = axes.back().in_base;
    PositionerLine line;
    line.axis = c.cell.robot.positioner[j].name;
    line.frame = axes.back().frame;
    line.point_m = before.translation();
    line.direction = before.linear().col(2);
    line.touched_rad =
        touched_range(touches, [&](const Touch& touch) { return carrying_rad(c.cell, touch, j); });
    if (c.covariance.size() > 0) {
      const LineMoves moves = moves_of(arm, axes);
      const auto base = base_motion(line.point_m);
      const Eigen::Matrix3d across =
          Eigen::Matrix3d::Identity() - line.direction * line.direction.transpose();
      line.place_u95_m = radius_95(across * bound.covariance(moves.point, base) * across);
      const Eigen::Matrix<double, 3, 6> turn = base_motion(line.point_m + line.direction) - base;
      line.direction_u95_rad = radius_95(bound.covariance(moves.direction, turn));
    }
    lines.push_back(std::move(line));
  }
  return lines;
}

Eigen::Isometry3d axis_as_found(const Calibration& c, std::size_t axis, const Vector3d& give_rad) {
  const auto error = [&](AxisError one) {
    return correction_of(c, positioner_parameter(axis, one));
  };
  return c.cell.robot.positioner.at(axis).frame *
         Eigen::Translation3d(error(AxisError::kX), error(AxisError::kY), 0.0) *
         Eigen::AngleAxisd(error(AxisError::kTurnX) + give_rad.x(), Vector3d::UnitX()) *
         Eigen::AngleAxisd(error(AxisError::kTurnY) + give_rad.y(), Vector3d::UnitY());
}

Vector3d give_rad_per_nm(const Calibration& c, std::size_t axis) {
  const auto of = [&](AxisError error) {
    return correction_of(c, positioner_parameter(axis, error));
  };
  return {of(AxisError::kBearingX), of(AxisError::kBearingY), of(AxisError::kCompliance)};
}

double largest_give_rad(const Calibration& c, std::size_t axis) {
  constexpr int kSteps = 36;
  const std::vector<PositionerAxis>& axes = c.cell.robot.positioner;
  const Vector3d per_nm = give_rad_per_nm(c, axis);
  if (per_nm.isZero(0.0)) return 0.0;
  double largest = 0.0;
  std::vector<int> step(axes.size(), 0);  // of each axis over its range
  std::vector<double> at(axes.size());
  for (std::size_t turned = 0; turned < axes.size();) {
    for (std::size_t j = 0; j < axes.size(); ++j)
      at[j] = axes[j].min_rad + (axes[j].max_rad - axes[j].min_rad) * step[j] / kSteps;
    const Vector3d moment = carried_moment_nm(c.cell.robot, at)[axis];
    largest = std::max(largest, per_nm.cwiseProduct(moment).norm());
    for (turned = 0; turned < axes.size() && step[turned] == kSteps; ++turned) step[turned] = 0;
    if (turned < axes.size()) ++step[turned];
  }
  return largest;
}

Eigen::Isometry3d carried_as_found(const Calibration& c, std::span<const double> positioner_rad,
                                   std::span<const double> outer_rad) {
  std::vector<double> all(positioner_rad.begin(), positioner_rad.end());
  all.insert(all.end(), outer_rad.begin(), outer_rad.end());
  const auto moment_nm = carried_moment_nm(c.cell.robot, all);
  Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
  for (std::size_t j = 0; j < positioner_rad.size(); ++j) {
    const double scale = 1.0 + correction_of(c, positioner_parameter(j, AxisError::kScale));
    const Vector3d give = give_rad_per_nm(c, j).cwiseProduct(moment_nm[j]);
    place =
        place * axis_as_found(c, j, give) *
        Eigen::AngleAxisd(c.cell.robot.positioner.at(j).sign * scale * positioner_rad[j] + give.z(),
                          Vector3d::UnitZ());
  }
  return place;
}

namespace {

/// Centres of the targets that at least so many axes carry, and the number of these.
struct CarriedCentre {
  Eigen::Vector3d centre_m;
  std::size_t axes;
};

std::vector<CarriedCentre> carried_centres(const Calibration& c, int axes) {
  std::vector<CarriedCentre> centres;
  for (const TargetResult& target : c.targets) {
    const auto stated = std::ranges::find(c.cell.targets, target.id, &Target::id);
    if (stated != c.cell.targets.end() && stated->carried_by >= axes)
      centres.push_back({target.centre_m, static_cast<std::size_t>(stated->carried_by)});
  }
  return centres;
}

Eigen::Vector3d within(double half_m, Random& random) {
  Eigen::Vector3d offset;
  for (double& one : offset) one = random.uniform(-half_m, half_m);
  return offset;
}

Eigen::Matrix3d any_orientation(Random& random) {
  Eigen::Quaterniond q;
  for (double& one : q.coeffs()) one = random.normal();
  return q.normalized().toRotationMatrix();
}

}  // namespace

TipMoves tip_moves(const ArmModel& arm, const std::vector<CarriedPose>& poses, const double* x_si) {
  const auto pose = [&](std::size_t k) {
    return arm.prepare(poses[k].joint_rad, 0, nullptr, poses[k].carrier_rad);
  };
  return tip_moves(arm, poses.size(), pose, x_si);
}

std::vector<CarriedPose> carried_poses(const ArmModel& arm, const Calibration& calibration,
                                       int axes, int count, unsigned seed) {
  constexpr int kAttempts = 50;  // per pose: most orientations of a long tool are out of reach
  const std::vector<CarriedCentre> centres = carried_centres(calibration, axes);
  std::vector<CarriedPose> poses;
  if (axes == 0 || centres.empty()) return poses;
  const Configurations ways(arm, 0.0);
  const Robot& robot = arm.robot();
  Random random(seed);
  for (int k = 0; k < kAttempts * count && static_cast<int>(poses.size()) < count; ++k) {
    std::vector<double> angles;
    for (const PositionerAxis& axis : robot.positioner)
      angles.push_back(random.uniform(axis.min_rad, axis.max_rad));
    const CarriedCentre& centre = centres[random.below(centres.size())];
    const Eigen::Isometry3d table = carried_at(robot, std::span(angles).first(centre.axes));
    Eigen::Isometry3d tcp(any_orientation(random));
    tcp.translation() = table * (centre.centre_m + within(kNearTargetM, random));
    const Joint& first = robot.joints[0];
    const double track_m =
        first.is_prismatic() ? random.uniform(first.min_rad, first.max_rad) : 0.0;
    std::vector<JointVector> reached = ways.reach(tcp, track_m);
    if (reached.empty()) continue;
    angles.resize(static_cast<std::size_t>(axes));
    poses.push_back({std::move(reached[random.below(reached.size())]), std::move(angles)});
  }
  return poses;
}

}  // namespace cellcal::calib
