#include "calib/exchange/tables.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>

#include "calib/exchange/numbers.h"
#include "calib/model/units.h"
#include "calib/result/nominal_value.h"

namespace cellcal::calib {

namespace {

using nlohmann::ordered_json;

std::string comment_lines(const std::string& comment) {
  std::string text = comment.empty() ? "" : "# ";
  for (const char c : comment) {
    text += c;
    if (c == '\n') text += "# ";
  }
  return text.empty() ? text : text + '\n';
}

std::string yaml_frame(const std::string& name, const Eigen::Isometry3d& frame) {
  const Eigen::Vector3d xyz = frame.translation(), rpy = roll_pitch_yaw(frame.linear());
  constexpr const char* kKeys[] = {"x", "y", "z", "roll", "pitch", "yaw"};
  std::string text = "  " + name + ":\n";
  for (int k = 0; k < 6; ++k)
    text += fmt::format("    {}: {}\n", kKeys[k], shortest(k < 3 ? xyz[k] : rpy[k - 3]));
  return text;
}

std::string dh_cells(const Joint& joint) {
  return fmt::format("{},{},{},{},{}", shortest(joint.offset_rad * kDegPerRad),
                     shortest(joint.d_m * kMmPerM), shortest(joint.a_m * kMmPerM),
                     shortest(joint.alpha_rad * kDegPerRad), shortest(joint.beta_rad * kDegPerRad));
}

ordered_json frame_json(const Eigen::Isometry3d& frame) {
  const Eigen::Vector3d xyz = frame.translation(), rpy = roll_pitch_yaw(frame.linear());
  return {{"xyz_m", {xyz[0], xyz[1], xyz[2]}}, {"rpy_rad", {rpy[0], rpy[1], rpy[2]}}};
}

/// One that was identified, with its name in this file.
struct Field {
  ParameterKind kind;
  const char* name;
  double to_unit;
};
constexpr Field kGeometry[] = {{ParameterKind::kTheta, "theta_offset_deg", kDegPerRad},
                               {ParameterKind::kD, "d_mm", kMmPerM},
                               {ParameterKind::kA, "a_mm", kMmPerM},
                               {ParameterKind::kAlpha, "alpha_deg", kDegPerRad},
                               {ParameterKind::kBeta, "beta_deg", kDegPerRad}};

ordered_json joint_json(const Calibration& c, std::size_t i, const PlacedJoint& placed) {
  const Joint& nominal = c.cell.robot.joints.at(i);
  ordered_json json{{"name", nominal.name}, {"sign", nominal.sign}};
  for (const Field& field : kGeometry) {
    const ParameterKey key = joint_parameter(field.kind, i);
    const ParameterResult* found = find(c, key);
    const double stated = stated_value(c.cell, key);
    const double off = found == nullptr ? 0.0 : found->nominal + found->correction;
    ordered_json value{{"nominal", stated * field.to_unit},
                       {"calibrated", (stated + off) * field.to_unit}};
    if (found != nullptr) value["sigma"] = found->sigma * field.to_unit;
    json[field.name] = value;
  }
  json["frame"] = frame_json(placed.origin);
  json["axis"] = {placed.axis[0], placed.axis[1], placed.axis[2]};
  if (const auto* found = find(c, joint_parameter(ParameterKind::kCompliance, i)))
    json["compliance_rad_per_nm"] = {{"value", found->nominal + found->correction},
                                     {"sigma", found->sigma}};
  if (const auto* found = find(c, joint_parameter(ParameterKind::kPlay, i)))
    json["half_play_arcsec"] = {{"value", (found->nominal + found->correction) / kRadPerArcsec},
                                {"sigma", found->sigma / kRadPerArcsec}};
  ordered_json gear = ordered_json::array();
  for (const int order : nominal.harmonics) {
    const auto* cosine = find(c, wave_parameter(ParameterKind::kCosine, i, order));
    const auto* sine = find(c, wave_parameter(ParameterKind::kSine, i, order));
    if (cosine != nullptr && sine != nullptr)
      gear.push_back({{"order", order},
                      {"cos_arcsec", cosine->correction / kRadPerArcsec},
                      {"sin_arcsec", sine->correction / kRadPerArcsec}});
  }
  if (!gear.empty()) {
    json["gear_ratio"] = nominal.gear_ratio;
    json["gear"] = gear;
  }
  return json;
}

}  // namespace

std::string ros_yaml(const JointFrames& frames, const std::string& comment) {
  std::string text = comment_lines(comment) + "kinematics:\n";
  for (const PlacedJoint& joint : frames.joints)
    text += yaml_frame(ros_joint_name(joint.name), joint.origin);
  return text + yaml_frame("flange", frames.flange) + yaml_frame("tcp", frames.tcp);
}

std::string dh_csv(const RigidArm& nominal, const RigidArm& calibrated) {
  std::string text =
      "joint,sign,nominal_theta_offset_deg,nominal_d_mm,nominal_a_mm,nominal_alpha_deg,nominal_beta_deg,"
      "theta_offset_deg,d_mm,a_mm,alpha_deg,beta_deg\n";
  for (std::size_t i = 0; i < nominal.robot.joints.size(); ++i) {
    const Joint& stated = nominal.robot.joints[i];
    text += fmt::format("{},{},{},{}\n", stated.name, stated.sign, dh_cells(stated),
                        dh_cells(calibrated.robot.joints.at(i)));
  }
  return text;
}

std::string arm_json(const Calibration& calibration) {
  const RigidArm real = calibrated_rigid_arm(calibration);
  const JointFrames frames = joint_frames(real);
  const LeftOut out = left_out(calibration);
  ordered_json json{{"format", "cellcal.arm/1"}, {"robot", calibration.cell.robot.name}};
  json["joints"] = ordered_json::array();
  for (std::size_t i = 0; i < frames.joints.size(); ++i)
    json["joints"].push_back(joint_json(calibration, i, frames.joints[i]));
  json["base"] = frame_json(real.robot.base_fixed);
  json["flange"] = frame_json(frames.flange);
  json["tcp"] = frame_json(frames.tcp);
  if (const auto* bending = find(calibration, tool_parameter(ParameterKind::kDeflection, 0)))
    json["tool_bending_1_per_nm2"] = {{"value", bending->nominal + bending->correction},
                                      {"sigma", bending->sigma}};
  json["left_out_by_rigid_links"] = {{"mean_mm", out.mean_m * kMmPerM},
                                     {"max_mm", out.max_m * kMmPerM}};
  return json.dump(1, ' ', false, ordered_json::error_handler_t::replace) + '\n';
}

}  // namespace cellcal::calib
