#include "calib/export/external_kinematic.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "calib/estimate/external_axes.h"
#include "calib/export/rigid_arm.h"
#include "calib/model/error.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

using Eigen::Isometry3d;

/// From the axis' z to that of the controller, whose angle is positive about it.
Isometry3d in_its_sense(const PositionerAxis& axis) {
  Isometry3d turn = Isometry3d::Identity();
  if (axis.sign < 0) turn.rotate(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()));
  return turn;
}

std::string krl_frame(const Isometry3d& place) {
  const FrameMmDeg frame = to_frame(place);
  constexpr const char* kNames[] = {"X", "Y", "Z", "A", "B", "C"};
  std::string text;
  for (std::size_t k = 0; k < 6; ++k) {
    const double value = k < 3 ? frame.xyz_mm[k] : frame.abc_deg[k - 3];
    const double unit = k < 3 ? 1e4 : 1e5;  // 0.0001 mm, 0.00001 deg
    const double rounded = std::round(value * unit) / unit;
    text += fmt::format("{}{} {:.{}f}", k == 0 ? "{" : ",", kNames[k],
                        rounded == 0.0 ? 0.0 : rounded, k < 3 ? 4 : 5);
  }
  return text + "}";
}

/// "; E1: +- 0.025 mm across the axis, 0.060 mrad (95 %); scale of its angle +0.012 mrad/rad, not in these lines"
std::string bound_comment(const Calibration& c, std::size_t j) {
  constexpr double kMradPerRad = 1e3;
  std::string text = "; " + c.cell.robot.positioner[j].name + ":";
  if (j < c.positioner.size())
    text += fmt::format(" +- {:.3f} mm across the axis, {:.3f} mrad (95 %);",
                        c.positioner[j].place_u95_m * kMmPerM,
                        c.positioner[j].direction_u95_rad * kMradPerRad);
  text += fmt::format(" scale of its angle {:+.3f} mrad/rad",
                      correction_of(c, positioner_parameter(j, AxisError::kScale)) * kMradPerRad);
  if (const double give = largest_give_rad(c, j); give > 0.0)
    text += fmt::format(" and {:.3f} mrad that it gives at most under its load", give * kMradPerRad);
  return text + ", not in these lines\n";
}

}  // namespace

ExternalKinematic external_kinematic(const std::vector<PositionerAxis>& positioner) {
  ExternalKinematic found;
  Isometry3d before = Isometry3d::Identity();  // from the controller's frame to that of the file
  for (const PositionerAxis& axis : positioner) {
    const Isometry3d turn = in_its_sense(axis);
    found.axes.push_back(before * axis.frame * turn);
    before = turn.inverse();
  }
  found.flange = before;
  return found;
}

namespace {

/// A linear unit: its direction of travel seen from the arm's foot is a turn of the foot on the carriage.
std::string unit_lines(const Calibration& c) {
  const RigidArm real = calibrated_rigid_arm(c);
  const Joint &drawn = c.cell.robot.joints.front(), &found = real.robot.joints.front();
  const LinearUnitLine line = c.linear_unit ? *c.linear_unit : *linear_unit_line(c, {});
  const Isometry3d foot(
      Eigen::Quaterniond::FromTwoVectors(found.guide->along, drawn.guide->along));
  const OmittedEffects rest = left_out_of_unit(c, true), all = left_out_of_unit(c, false);
  return fmt::format(
      "; linear unit {0} as calibrated: direction of travel +- {1:.3f} mrad (95 %). The arm's foot on the carriage\n"
      "; turns by the frame below: $ETn_TFLA3=$ETn_TFLA3:$ROBROOT:(frame):INV_POS($ROBROOT), ETn its kinematic in\n"
      "; $EX_KIN with #ERSYS. Angles and {0} count as before; measure bases anew.\n"
      "; scale {2:+.4f} mm/m +- {3:.4f}, straightness, roll, pitch and yaw are not in machine data. As drawn the unit\n"
      "; costs {4:.3f} mm in the mean, {5:.3f} mm at most over the workspace; with the turn {6:.3f} and {7:.3f} mm.\n"
      "; (frame)={8}\n",
      found.name, line.direction_u95_rad * kMmPerM, line.scale * kMmPerM,
      line.scale_u95 * kMmPerM, all.mean_m * kMmPerM, all.max_m * kMmPerM, rest.mean_m * kMmPerM,
      rest.max_m * kMmPerM, krl_frame(foot));
}

std::string positioner_lines_of(const Calibration& c) {
  std::vector<PositionerAxis> axes = c.cell.robot.positioner;
  const ExternalKinematic drawn = external_kinematic(axes);
  for (std::size_t j = 0; j < axes.size(); ++j) axes[j].frame = axis_as_found(c, j);
  const ExternalKinematic found = external_kinematic(axes);
  std::string text =
      "; positioner as calibrated. ETn: its kinematic in $EX_KIN. Frames of the first axis are in the robot's base\n"
      "; frame, the root point MACHINE_DEF[n].ROOT being that of the robot ($ROBROOT); another root point: its\n"
      "; inverse times $ROBROOT times this frame. Angles count as before; measure bases on the table anew.\n";
  for (std::size_t j = 0; j < axes.size(); ++j) text += bound_comment(c, j);
  for (std::size_t j = 0; j < axes.size(); ++j)
    text += fmt::format("$ETn_TA{}{}={}\n", j + 1, j == 0 ? "KR" : fmt::format("A{}", j),
                        krl_frame(found.axes[j]));
  text += "$ETn_TFLA3=" + krl_frame(found.flange) + "\n";
  text +=
      "; or, in place of $ETn_TA1KR, which stays as drawn, the root point in the robot's base frame:\n"
      "; MACHINE_DEF[n].ROOT=" +
      krl_frame(found.axes[0] * drawn.axes[0].inverse()) + "\n";
  return text;
}

}  // namespace

std::string external_kinematic_lines(const Calibration& c) {
  const bool unit = c.cell.robot.first_turning() > 0, positioner = !c.cell.robot.positioner.empty();
  if (!unit && !positioner)
    throw FileError(
        "the robot has neither a linear unit (first [[joint]] prismatic) nor a positioner ([[positioner]] of the "
        "robot file), and --as kuka is their data");
  return (unit ? unit_lines(c) : std::string()) + (positioner ? positioner_lines_of(c) : std::string());
}

}  // namespace cellcal::calib
