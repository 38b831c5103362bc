// A positioner's chain under its errors, and its derivatives.

#include "calib/model/positioner.h"

#include <array>
#include <cmath>
#include <vector>

#include "calib/model/kinematics.h"
#include "calib/model/turns.h"

namespace cellcal::calib {

void ArmModel::prepare_positioner(std::span<const double> outer_rad, PreparedPose& pose) const {
  std::vector<double> angles(pose.carrier_rad.begin(), pose.carrier_rad.begin() + pose.carriers);
  angles.insert(angles.end(), outer_rad.begin(), outer_rad.end());
  const auto moment_nm = carried_moment_nm(robot_, angles);
  for (int p = last_tool_; p < size(); ++p) {
    const ArmParameter& parameter = parameters_[p];
    if (parameter.carrier >= pose.carriers) continue;
    const auto j = static_cast<std::size_t>(parameter.carrier);
    switch (AxisError{parameter.axis}) {
      case AxisError::kScale:
        pose.factor[p] = robot_.positioner[j].sign * pose.carrier_rad[j];
        break;
      case AxisError::kCompliance: pose.factor[p] = moment_nm[j].z(); break;
      case AxisError::kBearingX: pose.factor[p] = moment_nm[j].x(); break;
      case AxisError::kBearingY: pose.factor[p] = moment_nm[j].y(); break;
      case AxisError::kX:
      case AxisError::kY:
      case AxisError::kTurnX:
      case AxisError::kTurnY: pose.factor[p] = 1.0; break;
    }
  }
}

// (1c), and its axes
Eigen::Isometry3d ArmModel::base_of(const PreparedPose& pose, const double* x,
                                    ArmChain& chain) const {
  std::array<std::array<double, kAxisErrors>, kMaxPositionerAxes> error{};
  for (int p = last_tool_; x != nullptr && p < size(); ++p)
    error[static_cast<std::size_t>(parameters_[p].carrier)][parameters_[p].axis] =
        x[p] * pose.factor[p];
  const auto of = [&](std::size_t j, AxisError one) { return error[j][static_cast<int>(one)]; };
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  for (std::size_t j = 0; j < static_cast<std::size_t>(pose.carriers); ++j) {
    const PositionerAxis& axis = robot_.positioner[j];
    ArmChain::Carrier& its = chain.carrier[j];
    origin += rotation * axis.frame.translation();
    rotation = rotation * axis.frame.linear();
    its.x = rotation.col(0);
    its.y = rotation.col(1);
    origin += of(j, AxisError::kX) * its.x + of(j, AxisError::kY) * its.y;
    const Direction about_x = direction(of(j, AxisError::kTurnX) + of(j, AxisError::kBearingX)),
                    about_y = direction(of(j, AxisError::kTurnY) + of(j, AxisError::kBearingY));
    its.tilt_x = rotation.col(0);
    turn_x(rotation, about_x.c, about_x.s);
    its.tilt_y = rotation.col(1);
    turn_y(rotation, about_y.c, about_y.s);
    its.z = rotation.col(2);
    its.origin = origin;
    const double angle =
        axis.sign * pose.carrier_rad[j] + of(j, AxisError::kScale) + of(j, AxisError::kCompliance);
    turn_z(rotation, std::cos(angle), std::sin(angle));
  }
  Eigen::Isometry3d base(rotation.transpose());
  base.translation() = -(base.linear() * origin);
  for (std::size_t j = 0; j < static_cast<std::size_t>(pose.carriers); ++j) {
    ArmChain::Carrier& its = chain.carrier[j];
    for (Eigen::Vector3d* axis : {&its.x, &its.y, &its.tilt_x, &its.tilt_y, &its.z})
      *axis = base.linear() * *axis;
    its.origin = base * its.origin;
  }
  return base;
}

Eigen::Vector3d turn_by(const ArmChain::Carrier& carrier, AxisError error) {
  switch (error) {
    case AxisError::kTurnX:
    case AxisError::kBearingX: return -carrier.tilt_x;
    case AxisError::kTurnY:
    case AxisError::kBearingY: return -carrier.tilt_y;
    case AxisError::kScale:
    case AxisError::kCompliance: return -carrier.z;
    case AxisError::kX:
    case AxisError::kY: break;
  }
  return Eigen::Vector3d::Zero();
}

/// Its errors move the target's frame; seen from there the arm with its gravity moves as one body.
void ArmModel::carrier_derivative(const Eigen::Vector3d& n, const PreparedPose& pose,
                                  const ArmChain& chain, double* derivative,
                                  std::ptrdiff_t stride) const {
  for (int p = last_tool_; p < size(); ++p) {
    const ArmParameter& parameter = parameters_[p];
    double& out = derivative[p * stride];
    out = 0.0;
    if (parameter.carrier >= pose.carriers) continue;
    const auto j = static_cast<std::size_t>(parameter.carrier);
    const AxisError error{parameter.axis};
    const ArmChain::Carrier& its = chain.carrier[j];
    if (error == AxisError::kX || error == AxisError::kY)
      out = -(error == AxisError::kX ? its.x : its.y).dot(n);
    else
      out = pose.factor[p] * turn_by(its, error).cross(chain.tip - its.origin).dot(n);
  }
}

}  // namespace cellcal::calib
