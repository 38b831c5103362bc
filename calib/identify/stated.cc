#include "calib/identify/stated.h"

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
  const Eigen::Vector3d tip = cell.tool.tcp.translation();
  if (owner == "tool" && what == "x") return tip.x();
  if (owner == "tool" && what == "y") return tip.y();
  if (owner == "tool" && what == "z") return tip.z();
  return 0.0;
}

}  // namespace cellcal::calib
