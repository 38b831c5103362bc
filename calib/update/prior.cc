#include "calib/update/prior.h"

#include <algorithm>
#include <cmath>

#include "calib/model/error.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

/// A tip that the cell file takes for known may be off by that: as far as a change is looked for.
constexpr double kOpenTipM = 15e-3;
/// A length that is nothing, in an arm.
constexpr double kNoLengthM = 1e-4;

std::optional<Eigen::Index> place_of(const Calibration& c, const ParameterKey& key) {
  const auto found = std::ranges::find(c.parameters, key, &ParameterResult::key);
  if (found == c.parameters.end()) return std::nullopt;
  return found - c.parameters.begin();
}

void open_tip(Calibration& c) {
  for (int axis = 0; axis < 3; ++axis) {
    const ParameterKey key = tool_parameter(ParameterKind::kTcp, 0, axis);
    if (place_of(c, key)) continue;
    c.cell.tool.tcp_sigma_m[axis] = kOpenTipM;
    c.parameters.push_back({key, "mm", kMmPerM});
  }
  const auto had = c.covariance.rows(), has = static_cast<Eigen::Index>(c.parameters.size());
  c.covariance.conservativeResizeLike(Eigen::MatrixXd::Zero(has, has));
  if (c.frame_basis.rows() == had)
    c.frame_basis.conservativeResizeLike(Eigen::MatrixXd::Zero(has, c.frame_basis.cols()));
}

double per_root_month(const ParameterKey& key, const DriftPerMonth& drift) {
  switch (key.kind) {
    case ParameterKind::kTheta:
      return drift.zero_rad;
    case ParameterKind::kTcp:
      return key.tool == 0 ? drift.tip_m : 0.0;
    case ParameterKind::kCentre:
      return drift.centre_m;
    default:
      return 0.0;
  }
}

/// One entry of a column; false where there is no such parameter.
bool set(Eigen::MatrixXd& columns, Eigen::Index column, const Calibration& c,
         const ParameterKey& key, double value) {
  const auto row = place_of(c, key);
  if (row) columns(*row, column) = value;
  return row.has_value();
}

bool fill(const PossibleChange& change, const Calibration& c, Eigen::MatrixXd& columns) {
  switch (change.kind) {
    case ChangeKind::kNothing:
    case ChangeKind::kTouch:
      return true;
    case ChangeKind::kTool:
      for (int axis = 0; axis < 3; ++axis)
        if (!set(columns, axis, c, tool_parameter(ParameterKind::kTcp, 0, axis), 1.0)) return false;
      return true;
    case ChangeKind::kSphere:
      for (int axis = 0; axis < 3; ++axis) {
        const std::size_t target = c.cell.target_index(change.name);
        if (!set(columns, axis, c, target_parameter(ParameterKind::kCentre, target, axis), 1.0))
          return false;
      }
      return true;
    case ChangeKind::kJoint:
      return set(columns, 0, c, joint_parameter(ParameterKind::kTheta, change.index),
                 c.cell.robot.joints[change.index].sign);
    case ChangeKind::kGrowth:
      for (std::size_t i = 0; i < c.cell.robot.joints.size(); ++i) {
        const Joint& joint = c.cell.robot.joints[i];
        const auto grows = [&](ParameterKind kind, double length_m) {
          return set(columns, 0, c, joint_parameter(kind, i), length_m) ||
                 std::abs(length_m) < kNoLengthM;
        };
        if (!grows(ParameterKind::kD, joint.d_m) || !grows(ParameterKind::kA, joint.a_m))
          return false;
      }
      return true;
  }
  return false;
}

}  // namespace

Calibration with_drift(const Calibration& last, double months, const DriftPerMonth& drift) {
  if (last.covariance.size() == 0)
    throw IdentifyError(IdentifyError::Kind::kCalibration,
                        "the last calibration states no covariance: nothing can stand on it");
  Calibration c = last;
  open_tip(c);
  for (std::size_t i = 0; i < c.parameters.size(); ++i) {
    const double each = per_root_month(c.parameters[i].key, drift);
    const auto k = static_cast<Eigen::Index>(i);
    c.covariance(k, k) += each * each * std::max(0.0, months);  // (75)
  }
  return c;
}

std::optional<Eigen::MatrixXd> moved_by(const PossibleChange& change, const Calibration& c) {
  Eigen::MatrixXd columns =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(c.parameters.size()), change.size);
  if (!fill(change, c, columns)) return std::nullopt;
  return columns;
}

}  // namespace cellcal::calib
