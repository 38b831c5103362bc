#include "calib/result/nominal_value.h"

namespace cellcal::calib {

double stated_value(const Cell& cell, const ParameterKey& parameter) {
  if (parameter.kind == ParameterKind::kTcp) {
    const auto index = static_cast<std::size_t>(parameter.tool);
    const Tool& tool = index == 0 ? cell.tool : cell.other_tools.at(index - 1);
    return tool.tcp.translation()[parameter.axis];
  }
  if (!is_geometric(parameter.kind)) return 0.0;
  const Joint& joint = cell.robot.joints.at(static_cast<std::size_t>(parameter.joint));
  switch (parameter.kind) {
    case ParameterKind::kTheta:
      return joint.offset_rad;
    case ParameterKind::kD:
      return joint.d_m;
    case ParameterKind::kA:
      return joint.a_m;
    case ParameterKind::kAlpha:
      return joint.alpha_rad;
    default:
      return joint.beta_rad;
  }
}

}  // namespace cellcal::calib
