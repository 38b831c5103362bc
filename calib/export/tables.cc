#include "calib/export/tables.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "calib/estimate/external_axes.h"
#include "calib/files/text.h"
#include "calib/model/units.h"
#include "calib/result/level.h"

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

constexpr const char* kKeys[] = {"x", "y", "z", "roll", "pitch", "yaw"};

std::string yaml_frame(const std::string& name, const Eigen::Isometry3d& frame) {
  const Eigen::Vector3d xyz = frame.translation(), rpy = roll_pitch_yaw(frame.linear());
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

/// An identified parameter with its name in this file.
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

ordered_json with_sigma(const ParameterResult& p, double to_unit = 1.0) {
  return {{"value", (p.nominal + p.correction) * to_unit}, {"sigma", p.sigma * to_unit}};
}

/// Waves of one joint with these kinds as orders with both amplitudes, in the parameters' order.
ordered_json waves_json(const Calibration& c, std::size_t i, ParameterKind cosine,
                        ParameterKind sine) {
  ordered_json waves = ordered_json::array();
  for (const ParameterResult& p : c.parameters) {
    if (p.key.kind != cosine || p.key.joint != static_cast<int>(i)) continue;
    const double sine_rad = correction_of(c, wave_parameter(sine, i, p.key.harmonic));
    waves.push_back({{"order", p.key.harmonic},
                     {"cos_arcsec", p.correction / kRadPerArcsec},
                     {"sin_arcsec", sine_rad / kRadPerArcsec}});
  }
  return waves;
}

void add_waves(const Calibration& c, std::size_t i, const Joint& levelled, ordered_json& json) {
  if (ordered_json gear = waves_json(c, i, ParameterKind::kCosine, ParameterKind::kSine);
      !gear.empty()) {
    json["gear_ratio"] = levelled.gear_ratio;
    json["gear"] = std::move(gear);
  }
  ordered_json waves =
      waves_json(c, i, ParameterKind::kFunctionCosine, ParameterKind::kFunctionSine);
  if (waves.empty()) return;
  json["function"] = std::move(waves);
  if (levelled.function_max_rad > levelled.function_min_rad)
    json["function_deg"] = {levelled.function_min_rad * kDegPerRad,
                            levelled.function_max_rad * kDegPerRad};
}

void add_mass(double mass_kg, const Eigen::Vector3d& com_m, ordered_json& json) {
  if (!(mass_kg > 0.0)) return;
  json["mass_kg"] = mass_kg;
  json["com_m"] = {com_m[0], com_m[1], com_m[2]};
}

/// Deflections by gravity's moments, with the masses that these follow from.
void add_elastic(const Calibration& c, std::size_t i, const Joint& levelled, ordered_json& json) {
  add_mass(levelled.mass_kg, levelled.com_m, json);
  for (const ParameterResult& p : c.parameters) {
    if (p.key.joint != static_cast<int>(i)) continue;
    if (p.key.kind == ParameterKind::kCompliance) {
      json["compliance_rad_per_nm"] = with_sigma(p);
    } else if (p.key.kind == ParameterKind::kPlay) {
      json["half_play_arcsec"] = with_sigma(p, 1.0 / kRadPerArcsec);
      json["half_play_arcsec"]["closes_nm"] = levelled.play_closes_nm;
    } else if (p.key.kind == ParameterKind::kStiffening) {
      json["stiffening_arcsec"] = with_sigma(p, 1.0 / kRadPerArcsec);
      json["stiffening_arcsec"]["stiff_nm"] = levelled.stiffening_nm;
    } else if (p.key.kind == ParameterKind::kBearing) {
      json[p.key.axis == 0 ? "bearing_x_rad_per_nm" : "bearing_y_rad_per_nm"] = with_sigma(p);
    } else if (p.key.kind == ParameterKind::kLoad) {
      ordered_json load = with_sigma(p);
      load["link"] = c.cell.robot.joints.at(static_cast<std::size_t>(p.key.link)).name;
      load["axis"] = std::string(1, "xyz"[p.key.axis]);
      json["load_kg_m_rad_per_nm"].push_back(std::move(load));
    }
  }
}

ordered_json joint_json(const Calibration& c, std::size_t i, const Joint& levelled,
                        const PlacedJoint& placed) {
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
  add_elastic(c, i, levelled, json);
  add_waves(c, i, levelled, json);
  return json;
}

/// Motions of a linear unit by (1b) of calib/model: slopes and waves in the guide's axes.
ordered_json linear_unit_json(const Calibration& c) {
  const Joint& unit = c.cell.robot.joints.front();
  ordered_json json{{"name", unit.name}};
  json["frame"] = frame_json(c.cell.robot.base_fixed * Eigen::Isometry3d(guide_axes(c.cell.robot)));
  json["min_m"] = unit.min_rad;
  json["max_m"] = unit.max_rad;
  constexpr const char* kNames[] = {"along_m",  "across_m",  "above_m",
                                    "roll_rad", "pitch_rad", "yaw_rad"};
  for (int k = 0; k < kGuideMotions; ++k) {
    ordered_json motion{{"slope_per_m", {{"value", 0.0}, {"sigma", 0.0}}},
                        {"wave", ordered_json::array()}};
    for (const ParameterResult& p : c.parameters) {
      if (p.key.kind != ParameterKind::kGuide || p.key.axis != k) continue;
      if (p.key.harmonic == 0) {
        motion["slope_per_m"] = with_sigma(p);
        continue;
      }
      ordered_json wave{{"order", p.key.harmonic}};
      wave.update(with_sigma(p));
      motion["wave"].push_back(std::move(wave));
    }
    json[kNames[k]] = std::move(motion);
  }
  return json;
}

/// An axis that turns by `axis` times e_j (1 + scale) in its frame, and gives under its load.
ordered_json positioner_json(const Calibration& c, std::size_t j, const PlacedJoint& placed) {
  ordered_json json{{"name", placed.name}};
  json["frame"] = frame_json(placed.origin);
  json["axis"] = {placed.axis[0], placed.axis[1], placed.axis[2]};
  json["min_deg"] = placed.min_rad * kDegPerRad;
  json["max_deg"] = placed.max_rad * kDegPerRad;
  struct Error {
    AxisError error;
    const char* name;
  };
  constexpr Error kErrors[] = {{AxisError::kX, "x_m"},
                               {AxisError::kY, "y_m"},
                               {AxisError::kTurnX, "rx_rad"},
                               {AxisError::kTurnY, "ry_rad"},
                               {AxisError::kScale, "scale"},
                               {AxisError::kCompliance, "compliance_rad_per_nm"},
                               {AxisError::kBearingX, "bearing_x_rad_per_nm"},
                               {AxisError::kBearingY, "bearing_y_rad_per_nm"}};
  for (const Error& one : kErrors)
    if (const auto* found = find(c, positioner_parameter(j, one.error)))
      json[one.name] = with_sigma(*found);
  const PositionerAxis& stated = c.cell.robot.positioner[j];
  add_mass(stated.mass_kg, stated.com_m, json);
  return json;
}

}  // namespace

std::string unit_yaml(const Calibration& c, const PlacedJoint& placed) {
  if (c.cell.robot.first_turning() == 0) return {};
  constexpr double kIntervalM = 0.01;
  const double low_m = c.cell.robot.joints.front().min_rad,
               stroke_m = c.cell.robot.joints.front().max_rad - low_m;
  const int intervals = std::max(1, static_cast<int>(std::ceil(stroke_m / kIntervalM)));
  std::vector<double> positions;
  for (int k = 0; k <= intervals; ++k) positions.push_back(low_m + stroke_m * k / intervals);
  const std::vector<Eigen::Isometry3d> carriage = carriage_as_found(c, positions);
  const Eigen::Isometry3d foot = calibrated_rigid_arm(c).robot.base_fixed.inverse() * placed.origin;
  std::array<std::string, 7> rows;
  for (std::size_t k = 0; k < positions.size(); ++k) {
    const Eigen::Isometry3d off = Eigen::Translation3d(-positions[k] * placed.axis) *
                                  (placed.origin.inverse() * carriage[k] * foot);
    const Eigen::Vector3d rpy = roll_pitch_yaw(off.linear());
    const double row[] = {positions[k],
                          off.translation()[0],
                          off.translation()[1],
                          off.translation()[2],
                          rpy[0],
                          rpy[1],
                          rpy[2]};
    for (std::size_t j = 0; j < rows.size(); ++j)
      rows[j] += (k == 0 ? "" : ", ") + shortest(row[j]);
  }
  std::string text = ros_joint_name(placed.name) + "_motion:\n  position: [" + rows[0] + "]\n";
  for (std::size_t j = 1; j < rows.size(); ++j)
    text += fmt::format("  {}: [{}]\n", kKeys[j - 1], rows[j]);
  return text;
}

std::string ros_yaml(const JointFrames& frames, const std::string& comment) {
  std::string text = comment_lines(comment) + "kinematics:\n";
  for (const PlacedJoint& joint : frames.joints)
    text += yaml_frame(ros_joint_name(joint.name), joint.origin);
  text += yaml_frame("flange", frames.flange) + yaml_frame("tcp", frames.tcp);
  for (const PlacedJoint& joint : frames.positioner)
    text += yaml_frame(ros_joint_name(joint.name), joint.origin);
  return text;
}

std::string dh_csv(const RigidArm& nominal, const RigidArm& calibrated) {
  std::string text =
      "joint,sign,nominal_theta_offset_deg,nominal_d_mm,nominal_a_mm,nominal_alpha_deg,nominal_beta_deg,"
      "theta_offset_deg,d_mm,a_mm,alpha_deg,beta_deg\n";
  for (std::size_t i = nominal.robot.first_turning(); i < nominal.robot.joints.size(); ++i) {
    const Joint& stated = nominal.robot.joints[i];
    text += fmt::format("{},{},{},{}\n", stated.name, stated.sign, dh_cells(stated),
                        dh_cells(calibrated.robot.joints.at(i)));
  }
  return text;
}

std::string arm_json(const Calibration& calibration) {
  JointFrames frames = joint_frames(calibrated_rigid_arm(calibration));
  const OmittedEffects out = left_out(calibration, nearest_rigid_arm(calibration));
  const std::size_t first = calibration.cell.robot.first_turning();
  if (first > 0) frames.joints[1].origin = guide_axes(calibration.cell.robot).transpose();
  ordered_json json{{"format", "cellcal.arm/1"}, {"robot", calibration.cell.robot.name}};
  if (first > 0) json["linear_unit"] = linear_unit_json(calibration);
  json["joints"] = ordered_json::array();
  const Robot levelled = at_level(calibration.cell, calibration.level).robot;
  for (std::size_t i = first; i < frames.joints.size(); ++i)
    json["joints"].push_back(joint_json(calibration, i, levelled.joints.at(i), frames.joints[i]));
  json["base"] = frame_json(calibration.cell.robot.base_fixed);
  json["flange"] = frame_json(frames.flange);
  json["tcp"] = frame_json(frames.tcp);
  if (const auto* bending = find(calibration, tool_parameter(ParameterKind::kDeflection, 0)))
    json["tool_bending_1_per_nm2"] = with_sigma(*bending);
  const Tool& tool = calibration.cell.tool;
  json["tool"] = {{"mass_kg", tool.mass_kg},
                  {"com_m", {tool.com_m[0], tool.com_m[1], tool.com_m[2]}},
                  {"length_m", tool.length_m}};
  for (std::size_t j = 0; j < frames.positioner.size(); ++j)
    json["positioner"].push_back(positioner_json(calibration, j, frames.positioner[j]));
  const Eigen::Vector3d& gravity = calibration.cell.robot.gravity_m_s2;
  json["gravity_m_s2"] = {gravity[0], gravity[1], gravity[2]};
  json["left_out_by_rigid_links"] = {{"mean_mm", out.mean_m * kMmPerM},
                                     {"max_mm", out.max_m * kMmPerM}};
  return json.dump(1, ' ', false, ordered_json::error_handler_t::replace) + '\n';
}

std::string shortest(double value) { return fmt::format("{}", value == 0.0 ? 0.0 : value); }

std::string shortest(const Eigen::Vector3d& values) {
  return shortest(values.x()) + ' ' + shortest(values.y()) + ' ' + shortest(values.z());
}

std::optional<double> number(std::string_view text) {
  text = trimmed(text);
  if (text.size() > 1 && text[0] == '+' && text[1] != '-')
    text.remove_prefix(1);  // from_chars rejects a plus sign
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    return std::nullopt;
  return value;
}

std::optional<Eigen::Vector3d> three_numbers(std::string_view text) {
  Eigen::Vector3d values;
  text = trimmed(text);
  const std::string_view between = text.find(',') == std::string_view::npos ? kBlanks : ",";
  for (int k = 0; k < 3; ++k) {
    const auto end = k < 2 ? text.find_first_of(between) : text.size();
    if (end == std::string_view::npos) return std::nullopt;
    const auto value = number(text.substr(0, end));
    if (!value) return std::nullopt;
    values[k] = *value;
    text = trimmed(text.substr(std::min(end + 1, text.size())));
  }
  if (!text.empty()) return std::nullopt;
  return values;
}

std::string robot_joint_name(const std::string& name) {
  constexpr std::string_view kBefore = "joint_";
  // In robot1_joint_a1 the prefix is the package's; joint_1 is A1.
  const auto before = name.rfind(kBefore);
  const auto behind = before == std::string::npos ? name.size() : before + kBefore.size();
  const bool ros = behind < name.size() && (before == 0 || name[before - 1] == '_');
  const bool number = ros && name.find_first_not_of("0123456789", behind) == std::string::npos;
  std::string result = number ? "A" : "";
  for (const char c : ros ? name.substr(behind) : name)
    result += c >= 'a' && c <= 'z' && ros ? static_cast<char>(c - 'a' + 'A')
              : static_cast<unsigned char>(c) <= ' ' || c == ',' || c == '"' || c == '#' ? '_'
                                                                                         : c;
  return result;
}

std::string ros_joint_name(const std::string& name) { return "joint_" + lower_case(name); }

}  // namespace cellcal::calib
