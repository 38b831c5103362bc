// The list of an arm's possible errors.

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <stdexcept>

#include "calib/model/enum_table.h"
#include "calib/model/kinematics.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
constexpr double kArcsecPerRad = 3600.0 * kDegPerRad;

constexpr EnumTable<JointError, ParameterKind> kKindOfError{
    {{JointError::kTheta, ParameterKind::kTheta},
     {JointError::kD, ParameterKind::kD},
     {JointError::kA, ParameterKind::kA},
     {JointError::kAlpha, ParameterKind::kAlpha},
     {JointError::kBeta, ParameterKind::kBeta}}};

/// True if the link frame's axis coincides with the joint axis.
bool along_own_axis(const Joint& joint, int axis) {
  const Matrix3d turn = (Eigen::AngleAxisd(joint.alpha_rad, Vector3d::UnitX()) *
                         Eigen::AngleAxisd(joint.beta_rad, Vector3d::UnitY()))
                            .toRotationMatrix();
  constexpr double kRounding = 1e-9;
  return std::abs(turn(2, axis)) > 1.0 - kRounding;
}

/// (1a), the guide's axes. Columns along, across and above: above is the preceding frame's z, or x, less its part along.
Matrix3d axes_of(const LinearGuide& guide) {
  constexpr double kNearlyUpright = 0.9;
  const Vector3d x = guide.along.normalized();
  const Vector3d up = std::abs(x.z()) < kNearlyUpright ? Vector3d::UnitZ() : Vector3d::UnitX();
  Matrix3d axes;
  axes.col(0) = x;
  axes.col(1) = up.cross(x).normalized();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return axes;
}

bool is_length(JointError error) { return error == JointError::kD || error == JointError::kA; }

}  // namespace

ArmModel::ArmModel(const Robot& robot, const Tool& tool, const std::vector<Tool>& others,
                   const std::vector<Load>& loads)
    : robot_(robot), tools_{tool}, loads_(loads) {
  tools_.insert(tools_.end(), others.begin(), others.end());
  if (tools_.size() > kMaxTools)
    throw std::invalid_argument("ArmModel: " + std::to_string(tools_.size()) +
                                " tools on one flange; at most " + std::to_string(kMaxTools));
  if (robot.joints.empty() || robot.joints.size() > kMaxJoints)
    throw std::invalid_argument("ArmModel: a robot needs 1 to " + std::to_string(kMaxJoints) +
                                " joints, but has " + std::to_string(robot.joints.size()));
  if (robot.positioner.size() > kMaxPositionerAxes)
    throw std::invalid_argument("ArmModel: a positioner has at most " +
                                std::to_string(kMaxPositionerAxes) + " axes");
  const std::size_t joints = robot_.joints.size();
  for (std::size_t at = 0; at < joints; ++at) {
    const Joint& joint = robot_.joints[at];
    for (JointError error : joint.errors) {
      const bool length = is_length(error);
      const double sigma = length ? joint.tolerance_length_m : joint.tolerance_angle_rad;
      if (sigma <= 0.0) continue;
      parameters_.push_back({joint_parameter(kKindOfError[error], at), sigma, length ? "mm" : "deg",
                             length ? 1000.0 : kDegPerRad});
    }
  }
  first_by_pose_ = size();
  for (std::size_t i = 0; i < joints; ++i) {
    const Joint& joint = robot_.joints[i];
    if (joint.compliance_sigma_rad_per_nm > 0.0)
      parameters_.push_back({joint_parameter(ParameterKind::kCompliance, i),
                             joint.compliance_sigma_rad_per_nm, "rad/(N m)", 1.0});
  }
  for (std::size_t i = 0; i < joints; ++i) {
    const Joint& joint = robot_.joints[i];
    if (joint.compliance_sigma_rad_per_nm <= 0.0) continue;
    for (std::size_t j = i; j < joints; ++j) {
      const Joint& link = robot_.joints[j];
      for (int axis = 0; axis < 3 && link.moment_sigma_kg_m > 0.0; ++axis) {
        if (j == i && along_own_axis(link, axis)) continue;  // does not load its own joint
        parameters_.push_back({load_parameter(i, j, axis),
                               joint.compliance_sigma_rad_per_nm * link.moment_sigma_kg_m,
                               "kg m rad/(N m)", 1.0});
      }
    }
  }
  for (std::size_t i = 0; i < joints; ++i) {
    const Joint& joint = robot_.joints[i];
    if (joint.play_sigma_rad > 0.0)
      parameters_.push_back({joint_parameter(ParameterKind::kPlay, i), joint.play_sigma_rad,
                             "arcsec", kArcsecPerRad});
  }
  for (std::size_t i = 0; i < joints; ++i) {
    const Joint& joint = robot_.joints[i];
    if (joint.harmonic_sigma_rad <= 0.0) continue;
    for (int h : joint.harmonics) {
      const double sigma = joint.harmonic_sigma_rad / std::pow(h, joint.harmonic_falloff);
      for (const ParameterKind kind : {ParameterKind::kCosine, ParameterKind::kSine})
        parameters_.push_back({wave_parameter(kind, i, h), sigma, "arcsec", kArcsecPerRad});
    }
  }
  for (std::size_t i = 0; i < joints; ++i) {
    if (robot_.joints[i].stiffening_sigma_rad > 0.0)
      parameters_.push_back({joint_parameter(ParameterKind::kStiffening, i),
                             robot_.joints[i].stiffening_sigma_rad, "arcsec", kArcsecPerRad});
    add_counterbalance(i);
    add_function(i);
  }
  last_by_pose_ = size();
  for (std::size_t i = 0; i < joints; ++i)
    for (int axis = 0; axis < 2 && robot_.joints[i].bearing_sigma_rad_per_nm > 0.0; ++axis)
      parameters_.push_back({bearing_parameter(i, axis), robot_.joints[i].bearing_sigma_rad_per_nm,
                             "rad/(N m)", 1.0});
  last_bearing_ = size();
  for (std::size_t i = 0; i < joints; ++i) add_guide(i);
  last_guide_ = size();
  for (int k = 0; k < tool_count(); ++k) add_tool_parameters(k);
  last_tool_ = size();
  add_positioner();
  none_ = errors(nullptr);
}

/// (2b): a spring's torque over its lever is smooth in the angle, its orders fall off fast.
void ArmModel::add_counterbalance(std::size_t index) {
  const double sigma = robot_.joints[index].counterbalance_sigma_rad;
  for (int order = 1; sigma > 0.0 && order <= kCounterbalanceOrders; ++order)
    for (const ParameterKind kind : {ParameterKind::kFunctionCosine, ParameterKind::kFunctionSine})
      parameters_.push_back(
          {wave_parameter(kind, index, order), sigma / (order * order), "arcsec", kArcsecPerRad});
}

/// The function's bands and, on top of them, single waves.
void ArmModel::add_function(std::size_t index) {
  const Joint& joint = robot_.joints[index];
  std::map<int, double> sigma_rad;
  const auto add_band = [&](double rms_rad, int lowest, int highest) {
    if (!(rms_rad > 0.0)) return;
    for (const double share : function_shares(joint.function_reach_rad, lowest, highest))
      sigma_rad[lowest++] = rms_rad * share;
  };
  add_band(joint.function_sigma_rad, kLowestOrder, kHighestOrder);
  add_band(joint.function_fast_sigma_rad, kHighestOrder + 1, kFastestOrder);
  for (const JointWave& wave : joint.waves)
    sigma_rad[wave.order] = std::hypot(sigma_rad[wave.order], wave.sigma_rad);
  for (const auto& [order, sigma] : sigma_rad)
    for (const ParameterKind kind : {ParameterKind::kFunctionCosine, ParameterKind::kFunctionSine})
      parameters_.push_back({wave_parameter(kind, index, order), sigma, "arcsec", kArcsecPerRad});
}

// (2a): the variances of the orders add up to that of the function.
std::vector<double> function_shares(double reach_rad, int lowest, int highest) {
  const double edge = std::numbers::sqrt3 / reach_rad;
  std::vector<double> shares;
  double sum = 0.0;
  for (int order = lowest; order <= highest; ++order) {
    shares.push_back(1.0 / (edge * edge + order * order));
    sum += std::pow(shares.back(), 2);
  }
  for (double& share : shares) share /= std::sqrt(sum);
  return shares;
}

int guide_orders(double stroke_m) {
  constexpr double kHalfWaveM = 0.5;
  constexpr double kFewest = 4.0, kMost = 24.0;
  return static_cast<int>(std::clamp(std::ceil(stroke_m / kHalfWaveM), kFewest, kMost));
}

/// (1b): the variances of the waves add up to that of the motion, as a smoothing spline's they fall
/// with the fourth power of the order.
void ArmModel::add_guide(std::size_t index) {
  const Joint& joint = robot_.joints[index];
  guide_axes_.emplace_back();
  if (!joint.guide) return;
  const LinearGuide& guide = *joint.guide;
  guide_axes_.back() = axes_of(guide);
  const int orders = guide_orders(joint.max_rad - joint.min_rad);
  double sum = 0.0;
  for (int order = 1; order <= orders; ++order) sum += std::pow(order, -4.0) / 2.0;
  const auto add = [&](GuideMotion motion, int order, double sigma) {
    if (!(sigma > 0.0)) return;
    const std::string unit =
        std::string(is_shift(motion) ? "mm" : "mrad") + (order == 0 ? "/m" : "");
    parameters_.push_back({guide_parameter(index, motion, order), sigma, unit, 1000.0});
  };
  for (int k = 0; k < kGuideMotions; ++k) {
    const GuideMotion motion{k};
    add(motion, 0,
        motion == GuideMotion::kAlong ? guide.scale_sigma
        : is_shift(motion)            ? guide.direction_sigma_rad
                                      : guide.turn_sigma_rad_m);
    const double rms = is_shift(motion) ? guide.straightness_sigma_m : guide.turn_sigma_rad;
    for (int order = 1; order <= orders; ++order)
      add(motion, order, rms / (order * order * std::sqrt(sum)));
  }
}

void ArmModel::add_tool_parameters(int index) {
  const Tool& tool = tools_[static_cast<std::size_t>(index)];
  stiff_.push_back(tool.mass_kg * tool.length_m * tool.length_m * tool.length_m / 3.0);
  const auto which = static_cast<std::size_t>(index);
  if (tool.deflection_sigma > 0.0)
    parameters_.push_back({tool_parameter(ParameterKind::kDeflection, which), tool.deflection_sigma,
                           "1/(N m^2)", 1.0});
  for (int axis = 0; axis < 3; ++axis)
    if (tool.tcp_sigma_m[axis] > 0.0)
      parameters_.push_back(
          {tool_parameter(ParameterKind::kTcp, which, axis), tool.tcp_sigma_m[axis], "mm", 1000.0});
}

/// Zero of its angle and shift along the axis move all that it carries, and are left out: they are
/// absorbed by the places of the next axis and of the targets.
void ArmModel::add_positioner() {
  for (std::size_t j = 0; j < robot_.positioner.size(); ++j) {
    const PositionerAxis& axis = robot_.positioner[j];
    const auto add = [&](AxisError error, double sigma, const char* unit, double to_unit = 1000.0) {
      if (sigma > 0.0)
        parameters_.push_back({positioner_parameter(j, error), sigma, unit, to_unit});
    };
    add(AxisError::kX, axis.place_sigma_m, "mm");
    add(AxisError::kY, axis.place_sigma_m, "mm");
    add(AxisError::kTurnX, axis.direction_sigma_rad, "mrad");
    add(AxisError::kTurnY, axis.direction_sigma_rad, "mrad");
    add(AxisError::kScale, axis.scale_sigma, "mrad/rad");
    if (std::ranges::none_of(robot_.positioner.begin() + static_cast<std::ptrdiff_t>(j),
                             robot_.positioner.end(),
                             [](const PositionerAxis& one) { return one.mass_kg > 0.0; }))
      continue;  // nothing loads it
    const char* unit = "rad/(N m)";
    add(AxisError::kCompliance, axis.compliance_sigma_rad_per_nm, unit, 1.0);
    add(AxisError::kBearingX, axis.bearing_sigma_rad_per_nm, unit, 1.0);
    add(AxisError::kBearingY, axis.bearing_sigma_rad_per_nm, unit, 1.0);
  }
}

}  // namespace cellcal::calib
