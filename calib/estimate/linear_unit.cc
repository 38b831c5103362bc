#include "calib/estimate/linear_unit.h"

#include <algorithm>
#include <cmath>

#include "calib/estimate/predict.h"
#include "calib/estimate/region.h"

namespace cellcal::calib {

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

std::optional<std::array<double, 2>> touched_range(std::span<const Touch> touches) {
  std::optional<std::array<double, 2>> range;
  for (const Touch& touch : touches) {
    if (touch.set != TouchSet::kFit || touch.joint_rad.empty()) continue;
    const double at = touch.joint_rad.front();
    if (!range) range = {at, at};
    range = {std::min((*range)[0], at), std::max((*range)[1], at)};
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
  const Eigen::Matrix<double, 3, 6> turn = base_motion(line.direction) - base_motion(Vector3d::Zero());
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

std::optional<LinearUnitLine> linear_unit_line(const Calibration& c, std::span<const Touch> touches) {
  if (c.cell.robot.first_turning() == 0) return std::nullopt;
  const ArmModel arm(at_level(c.cell, c.level));
  const Eigen::VectorXd x = arm_values(arm, c);
  const Eigen::MatrixXd covariance = arm_covariance(arm, c);
  const Joint& unit = c.cell.robot.joints.front();
  LinearUnitLine line;
  line.axis = unit.name;
  line.touched_m = touched_range(touches);
  const double stroke_m = unit.max_rad - unit.min_rad;
  const int intervals = std::max(kLeastIntervals, kPerOrder * guide_orders(stroke_m));
  for (int k = 0; k <= intervals; ++k)
    line.at.push_back(motion_at(arm, x, covariance, unit.min_rad + stroke_m * k / intervals));
  add_slopes(c, arm, covariance, line);
  return line;
}

}  // namespace cellcal::calib
