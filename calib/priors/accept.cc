#include "calib/priors/accept.h"

#include <algorithm>

#include "calib/files/robot_file.h"
#include "calib/result/level.h"

namespace cellcal::calib {

namespace {

/// The joint's field for a prior of this kind.
double Joint::*place_of(SpreadKind kind) {
  switch (kind) {
    case SpreadKind::kLength:
      return &Joint::tolerance_length_m;
    case SpreadKind::kAngle:
      return &Joint::tolerance_angle_rad;
    case SpreadKind::kCompliance:
      return &Joint::compliance_sigma_rad_per_nm;
    case SpreadKind::kGear:
      return &Joint::harmonic_sigma_rad;
  }
  return nullptr;
}

/// Sets the gear orders assumed by an estimate if the file names none.
void set_default_orders(Robot& robot) {
  Cell cell;
  cell.robot = robot;
  const Robot assumed = at_level(cell, {}).robot;
  for (std::size_t i = 0; i < robot.joints.size(); ++i) {
    Joint& joint = robot.joints[i];
    joint.harmonics = assumed.joints[i].harmonics;
    joint.harmonic_falloff = assumed.joints[i].harmonic_falloff;
    joint.gear_ratio = assumed.joints[i].gear_ratio;
    joint.harmonic_sigma_rad = assumed.joints[i].harmonic_sigma_rad;
  }
}

}  // namespace

std::variant<Accepted, OtherNominalGeometry> accept(const Robot& robot, const FleetPriors& priors) {
  if (const std::string own = nominal_geometry_sha256(robot); own != priors.nominal_geometry)
    return OtherNominalGeometry{priors.nominal_geometry, own};
  Accepted accepted{robot, {}};
  const bool gears_named =
      std::ranges::any_of(robot.joints, [](const Joint& j) { return j.harmonic_sigma_rad > 0.0; });
  const bool gears_learned = std::ranges::any_of(
      priors.joints, [](const JointPriors& j) { return j.of(SpreadKind::kGear).has_value(); });
  if (!gears_named && gears_learned) set_default_orders(accepted.robot);
  for (const JointPriors& prior : priors.joints) {
    const auto at = std::ranges::find(accepted.robot.joints, prior.joint, &Joint::name);
    if (at == accepted.robot.joints.end()) continue;
    const Joint& old = robot.joints[static_cast<std::size_t>(at - accepted.robot.joints.begin())];
    for (const SpreadKind kind : kSpreadKinds) {
      const auto& spread = prior.of(kind);
      double& value = (*at).*place_of(kind);
      if (!spread || !(value > 0.0)) continue;
      value = offered(*spread);
      accepted.changes.push_back({prior.joint, kind, old.*place_of(kind), value});
    }
  }
  return accepted;
}

}  // namespace cellcal::calib
