#include "calib/result/nominal_value.h"

namespace cellcal::calib {

double stated_value(const Cell& cell, std::string_view parameter) {
  const std::size_t dot = parameter.rfind('.');
  if (dot == std::string_view::npos) return 0.0;
  const std::string_view owner = parameter.substr(0, dot), what = parameter.substr(dot + 1);
  for (const Joint& joint : cell.robot.joints) {
    if (owner != joint.name) continue;
    if (what == "theta") return joint.offset_rad;
    if (what == "d") return joint.d_m;
    if (what == "a") return joint.a_m;
    if (what == "alpha") return joint.alpha_rad;
    if (what == "beta") return joint.beta_rad;
    return 0.0;
  }
  const auto along = [&](const Tool& tool) {
    const Eigen::Vector3d tip = tool.tcp.translation();
    return what == "x" ? tip.x() : what == "y" ? tip.y() : what == "z" ? tip.z() : 0.0;
  };
  if (owner == cell.tool.name()) return along(cell.tool);
  for (const Tool& tool : cell.other_tools)
    if (owner == tool.name()) return along(tool);
  return 0.0;
}

}  // namespace cellcal::calib
