#include "calib/files/robot_file.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <system_error>
#include <utility>

#include "calib/files/cell_file.h"
#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/files/text.h"
#include "calib/files/toml.h"
#include "calib/files/touches.h"
#include "calib/model/kinematics.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

constexpr std::string_view kRobotFormat = "cellcal.robot/1";
constexpr std::size_t kMostJointsInFile = 32;
constexpr Range kRobotLengthMm{-1e5, 1e5};  // 100 m: above any arm
constexpr Range kAngleDeg{-3600.0, 3600.0};
constexpr Range kMassKg{0.0, 1e4};
constexpr Range kToleranceMm{0.0, 1e3};
constexpr Range kToleranceDeg{0.0, 90.0};

constexpr std::pair<std::string_view, JointError> kErrorNames[] = {
    {"theta", JointError::kTheta}, {"d", JointError::kD},       {"a", JointError::kA},
    {"alpha", JointError::kAlpha}, {"beta", JointError::kBeta},
};

constexpr std::pair<std::string_view, AbsoluteAccuracy> kAccuracyNames[] = {
    {"off", AbsoluteAccuracy::kOff},
    {"active", AbsoluteAccuracy::kActive},
    {"in this file", AbsoluteAccuracy::kInFile},
};

AbsoluteAccuracy read_accuracy(const TomlTable& document) {
  if (!document.has("absolute_accuracy")) return AbsoluteAccuracy::kNotStated;
  const std::string stated =
      document.word("absolute_accuracy",
                    {kAccuracyNames[0].first, kAccuracyNames[1].first, kAccuracyNames[2].first});
  const auto* found = std::find_if(std::begin(kAccuracyNames), std::end(kAccuracyNames),
                                   [&](const auto& one) { return one.first == stated; });
  return found->second;
}

Eigen::Isometry3d read_frame(const TomlTable& table) {
  FrameMmDeg frame;
  const auto xyz = table.numbers_or("xyz_mm", {0, 0, 0}, kRobotLengthMm);
  const auto abc = table.numbers_or("abc_deg", {0, 0, 0}, kAngleDeg);
  std::copy(xyz.begin(), xyz.end(), frame.xyz_mm.begin());
  std::copy(abc.begin(), abc.end(), frame.abc_deg.begin());
  table.refuse_unknown();
  return to_isometry(frame);
}

std::string read_joint_name(const TomlTable& t) {
  const std::string name = t.string("name");
  if (name.empty() || name.find_first_of(", \t\r\n\"#") != std::string::npos)
    t.fail("name", "must be a word without spaces, commas or quotes: it names a CSV column");
  if (std::find(std::begin(kTouchColumns), std::end(kTouchColumns), name) !=
      std::end(kTouchColumns))
    t.fail("name", "must not be \"" + name + "\": a column of touches is named so");
  return name;
}

/// Defaults: an installed unit of steel rails, rack and pinion.
constexpr double kScaleMmPerM = 0.5, kDirectionMrad = 3.0, kStraightnessMm = 0.3,
                 kTurnMradPerM = 0.5, kTurnMrad = 0.3;

}  // namespace

LinearGuide usual_guide() {
  LinearGuide guide;
  guide.scale_sigma = kScaleMmPerM / 1000.0;
  guide.direction_sigma_rad = kDirectionMrad / 1000.0;
  guide.straightness_sigma_m = kStraightnessMm / 1000.0;
  guide.turn_sigma_rad_m = kTurnMradPerM / 1000.0;
  guide.turn_sigma_rad = kTurnMrad / 1000.0;
  return guide;
}

PositionerAxis usual_positioner_axis() {
  PositionerAxis axis;
  axis.place_sigma_m = 2e-3;
  axis.direction_sigma_rad = 2e-3;
  axis.scale_sigma = 1e-4;
  // A cycloidal gear of 400 N m gives by 2.7e-6 and tilts by 3e-7 rad/(N m), its frame gives as well.
  axis.compliance_sigma_rad_per_nm = 2e-6;
  axis.bearing_sigma_rad_per_nm = 5e-7;
  return axis;
}

namespace {

/// A linear unit's.
Joint read_prismatic(const TomlTable& t) {
  Joint joint;
  joint.name = read_joint_name(t);
  LinearGuide& guide = joint.guide.emplace();
  const auto along = t.numbers("along", 3, {-1.0, 1.0});
  guide.along = Eigen::Vector3d(along[0], along[1], along[2]);
  constexpr double kUnitSlack = 0.01;
  if (std::abs(guide.along.norm() - 1.0) > kUnitSlack)
    t.fail("along", "must be a direction of length 1, as in [0.0, 1.0, 0.0]");
  guide.along.normalize();
  joint.min_rad = t.number("min_mm", kRobotLengthMm) / kMmPerM;
  joint.max_rad = t.number("max_mm", kRobotLengthMm) / kMmPerM;
  constexpr double kShortestM = 0.05;  // shorter strokes are given in metres
  if (joint.max_rad - joint.min_rad < kShortestM)
    t.fail("min_mm", "must be at least 50 mm less than max_mm");
  if (t.has("max_speed_mm_s"))
    joint.max_speed_rad_s = t.number("max_speed_mm_s", {1e-3, 1e5}) / kMmPerM;
  constexpr Range kPerMille{0.0, 100.0};
  const auto sigma = [&](const char* key, double usual, Range range) {
    return t.number_or(key, usual, range) / 1000.0;  // mm to m, mm/m to m/m, mrad to rad
  };
  guide.scale_sigma = sigma("scale_sigma_mm_per_m", kScaleMmPerM, kPerMille);
  guide.direction_sigma_rad = sigma("direction_sigma_mrad", kDirectionMrad, kPerMille);
  guide.straightness_sigma_m = sigma("straightness_sigma_mm", kStraightnessMm, kToleranceMm);
  guide.turn_sigma_rad_m = sigma("turn_sigma_mrad_per_m", kTurnMradPerM, kPerMille);
  guide.turn_sigma_rad = sigma("turn_sigma_mrad", kTurnMrad, kPerMille);
  t.refuse_unknown();
  return joint;
}

constexpr std::size_t kMostHarmonics = 16;
constexpr std::size_t kMostWaves = 32;  // more than a search finds in one joint

/// Whole numbers in the range, none twice.
std::vector<int> read_orders(const TomlTable& t, const char* key, Range range, std::size_t most) {
  std::vector<int> orders;
  if (!t.has(key)) return orders;
  for (const double order : t.numbers(key, 0, range)) {
    if (order != static_cast<int>(order)) t.fail(key, "must hold whole numbers");
    if (std::ranges::find(orders, static_cast<int>(order)) != orders.end())
      t.fail(key, "must not hold an order twice");
    orders.push_back(static_cast<int>(order));
  }
  if (orders.size() > most) t.fail(key, fmt::format("at most {} orders per joint", most));
  return orders;
}

std::vector<JointWave> read_waves(const TomlTable& t) {
  std::vector<JointWave> waves;
  for (const int order : read_orders(t, "wave_orders", {kLowestOrder, kHighestWave}, kMostWaves))
    waves.push_back({order});
  if (waves.empty()) return waves;
  const auto sigma = t.numbers("wave_sigma_arcsec", waves.size(), {1e-3, 1e5});
  for (std::size_t k = 0; k < waves.size(); ++k) waves[k].sigma_rad = sigma[k] * kRadPerArcsec;
  std::ranges::sort(waves, {}, &JointWave::order);
  return waves;
}

void read_mass(const TomlTable& t, double& mass_kg, Eigen::Vector3d& com_m) {
  mass_kg = t.number_or("mass_kg", 0.0, kMassKg);
  const auto com = t.numbers_or("com_mm", {0, 0, 0}, kRobotLengthMm);
  com_m = Eigen::Vector3d(com[0], com[1], com[2]) / kMmPerM;
}

Joint read_turning(const TomlTable& t, double length_m, double angle_rad) {
  Joint joint;
  joint.name = read_joint_name(t);
  joint.sign = static_cast<int>(t.integer_or("sign", 1, -1, 1));
  if (joint.sign == 0) t.fail("sign", "must be 1 or -1");
  joint.offset_rad = t.number_or("offset_deg", 0.0, kAngleDeg) * kRadPerDeg;
  joint.d_m = t.number("d_mm", kRobotLengthMm) / kMmPerM;
  joint.a_m = t.number("a_mm", kRobotLengthMm) / kMmPerM;
  joint.alpha_rad = t.number("alpha_deg", kAngleDeg) * kRadPerDeg;
  joint.beta_rad = t.number_or("beta_deg", 0.0, kAngleDeg) * kRadPerDeg;
  for (const std::string& word : t.strings("errors")) {
    const auto* found = std::find_if(std::begin(kErrorNames), std::end(kErrorNames),
                                     [&](const auto& entry) { return entry.first == word; });
    if (found == std::end(kErrorNames))
      t.fail("errors", "\"" + shown(word) + "\" is not known; use theta, d, a, alpha, beta");
    if (std::find(joint.errors.begin(), joint.errors.end(), found->second) != joint.errors.end())
      t.fail("errors", "\"" + word + "\" occurs twice");
    joint.errors.push_back(found->second);
  }
  joint.min_rad = t.number("min_deg", kAngleDeg) * kRadPerDeg;
  joint.max_rad = t.number("max_deg", kAngleDeg) * kRadPerDeg;
  if (joint.min_rad >= joint.max_rad) t.fail("min_deg", "must be less than max_deg");
  if (t.has("max_speed_deg_s"))
    joint.max_speed_rad_s = t.number("max_speed_deg_s", {1e-3, 1e5}) * kRadPerDeg;
  joint.tolerance_length_m =
      t.number_or("tolerance_length_mm", length_m * kMmPerM, kToleranceMm) / kMmPerM;
  joint.tolerance_angle_rad =
      t.number_or("tolerance_angle_deg", angle_rad * kDegPerRad, kToleranceDeg) * kRadPerDeg;
  read_mass(t, joint.mass_kg, joint.com_m);
  joint.compliance_sigma_rad_per_nm = t.number_or("compliance_sigma_rad_per_nm", 0.0, {0.0, 1.0});
  joint.gear_ratio = t.number_or("gear_ratio", 1.0, {-1e4, 1e4});
  joint.harmonics = read_orders(t, "harmonics", {1.0, 1000.0}, kMostHarmonics);
  joint.harmonic_sigma_rad = t.number_or("harmonic_sigma_arcsec", 0.0, {0.0, 1e5}) * kRadPerArcsec;
  joint.harmonic_falloff = t.number_or("harmonic_falloff", 0.0, {0.0, 10.0});
  joint.bearing_sigma_rad_per_nm = t.number_or("bearing_sigma_rad_per_nm", 0.0, {0.0, 1.0});
  joint.function_sigma_rad = t.number_or("function_sigma_arcsec", 0.0, {0.0, 1e5}) * kRadPerArcsec;
  joint.function_fast_sigma_rad =
      t.number_or("function_fast_sigma_arcsec", 0.0, {0.0, 1e5}) * kRadPerArcsec;
  joint.function_reach_rad = t.number_or("function_reach_deg", 5.0, {0.1, 180.0}) * kRadPerDeg;
  joint.waves = read_waves(t);
  joint.counterbalance_sigma_rad =
      t.number_or("counterbalance_sigma_arcsec", 0.0, {0.0, 1e5}) * kRadPerArcsec;
  joint.stiffening_sigma_rad =
      t.number_or("stiffening_sigma_arcsec", 0.0, {0.0, 1e5}) * kRadPerArcsec;
  joint.stiffening_nm = t.number_or("stiffening_nm", 1000.0, {1.0, 1e6});
  if (t.has("function_deg")) {
    const auto range = t.numbers("function_deg", 2, kAngleDeg);
    if (!(range[0] < range[1])) t.fail("function_deg", "must hold the smaller angle first");
    joint.function_min_rad = range[0] * kRadPerDeg;
    joint.function_max_rad = range[1] * kRadPerDeg;
  }
  constexpr Range kRadiusMm{1.0, 5e3};
  if (t.has("radius_mm")) joint.radius_m = t.number("radius_mm", kRadiusMm) / kMmPerM;
  t.refuse_unknown();
  return joint;
}

PositionerAxis read_positioner_axis(const TomlTable& t) {
  PositionerAxis axis = usual_positioner_axis();
  axis.name = read_joint_name(t);
  axis.sign = static_cast<int>(t.integer_or("sign", 1, -1, 1));
  if (axis.sign == 0) t.fail("sign", "must be 1 or -1");
  axis.min_rad = t.number("min_deg", kAngleDeg) * kRadPerDeg;
  axis.max_rad = t.number("max_deg", kAngleDeg) * kRadPerDeg;
  if (axis.min_rad >= axis.max_rad) t.fail("min_deg", "must be less than max_deg");
  if (t.has("max_speed_deg_s"))
    axis.max_speed_rad_s = t.number("max_speed_deg_s", {1e-3, 1e5}) * kRadPerDeg;
  constexpr Range kPerMille{0.0, 100.0};
  const auto sigma = [&](const char* key, double usual, const Range& range) {
    return t.has(key) ? t.number(key, range) / 1000.0 : usual;
  };
  axis.place_sigma_m = sigma("place_sigma_mm", axis.place_sigma_m, kToleranceMm);
  axis.direction_sigma_rad = sigma("direction_sigma_mrad", axis.direction_sigma_rad, kPerMille);
  axis.scale_sigma = sigma("scale_sigma_mrad_per_rad", axis.scale_sigma, kPerMille);
  read_mass(t, axis.mass_kg, axis.com_m);
  axis.compliance_sigma_rad_per_nm =
      t.number_or("compliance_sigma_rad_per_nm", axis.compliance_sigma_rad_per_nm, {0.0, 1.0});
  axis.bearing_sigma_rad_per_nm =
      t.number_or("bearing_sigma_rad_per_nm", axis.bearing_sigma_rad_per_nm, {0.0, 1.0});
  axis.frame = read_frame(t);
  return axis;
}

/// [[positioner]], one table per axis, base outwards.
void read_positioner(const TomlTable& document, std::set<std::string> names, Robot& robot) {
  for (const TomlTable& table : document.tables("positioner")) {
    if (robot.positioner.size() == kMaxPositionerAxes)
      table.fail("name", fmt::format("a positioner has at most {} axes", kMaxPositionerAxes));
    robot.positioner.push_back(read_positioner_axis(table));
    if (!names.insert(robot.positioner.back().name).second)
      table.fail("name", "\"" + shown(robot.positioner.back().name) + "\" occurs twice");
  }
}

Joint read_joint(const TomlTable& t, double length_m, double angle_rad) {
  const bool prismatic = t.has("kind") && t.word("kind", {"revolute", "prismatic"}) == "prismatic";
  return prismatic ? read_prismatic(t) : read_turning(t, length_m, angle_rad);
}

std::string prismatic_to_toml(const Joint& j) {
  const LinearGuide& guide = *j.guide;
  std::string out = fmt::format(
      "\n[[joint]]\nname = {}\nkind = \"prismatic\"\nalong = [{}, {}, {}]\nmin_mm = {}\n"
      "max_mm = {}\n",
      toml_string(j.name), toml_number(guide.along.x()), toml_number(guide.along.y()),
      toml_number(guide.along.z()), toml_number(j.min_rad * kMmPerM),
      toml_number(j.max_rad * kMmPerM));
  if (j.max_speed_rad_s > 0.0)
    out += fmt::format("max_speed_mm_s = {}\n", toml_number(j.max_speed_rad_s * kMmPerM));
  const std::pair<const char*, double> sigmas[] = {
      {"scale_sigma_mm_per_m", guide.scale_sigma},
      {"direction_sigma_mrad", guide.direction_sigma_rad},
      {"straightness_sigma_mm", guide.straightness_sigma_m},
      {"turn_sigma_mrad_per_m", guide.turn_sigma_rad_m},
      {"turn_sigma_mrad", guide.turn_sigma_rad}};
  for (const auto& [key, value] : sigmas)
    out += fmt::format("{} = {}\n", key, toml_number(value * 1000.0));
  return out;
}

std::string frame_lines(const Eigen::Isometry3d& isometry) {
  const FrameMmDeg f = to_frame(isometry);
  return fmt::format("xyz_mm = [{}, {}, {}]\nabc_deg = [{}, {}, {}]\n", toml_number(f.xyz_mm[0]),
                     toml_number(f.xyz_mm[1]), toml_number(f.xyz_mm[2]), toml_number(f.abc_deg[0]),
                     toml_number(f.abc_deg[1]), toml_number(f.abc_deg[2]));
}

std::string frame_table(const char* name, const Eigen::Isometry3d& isometry) {
  if (isometry.isApprox(Eigen::Isometry3d::Identity(), 0.0)) return {};
  return fmt::format("\n[{}]\n", name) + frame_lines(isometry);
}

std::string waves_to_toml(const std::vector<JointWave>& waves) {
  std::vector<int> orders;
  std::vector<std::string> sigmas;
  for (const JointWave& wave : waves) {
    orders.push_back(wave.order);
    sigmas.push_back(toml_number(wave.sigma_rad / kRadPerArcsec));
  }
  return fmt::format("wave_orders = [{}]\nwave_sigma_arcsec = [{}]\n", fmt::join(orders, ", "),
                     fmt::join(sigmas, ", "));
}

std::string axis_to_toml(const PositionerAxis& axis) {
  return fmt::format(
             "\n[[positioner]]\nname = {}\nsign = {}\nmin_deg = {}\nmax_deg = {}\n"
             "place_sigma_mm = {}\ndirection_sigma_mrad = {}\nscale_sigma_mrad_per_rad = {}\n",
             toml_string(axis.name), axis.sign, toml_number(axis.min_rad * kDegPerRad),
             toml_number(axis.max_rad * kDegPerRad), toml_number(axis.place_sigma_m * kMmPerM),
             toml_number(axis.direction_sigma_rad * 1000.0),
             toml_number(axis.scale_sigma * 1000.0)) +
         (axis.max_speed_rad_s > 0.0
              ? fmt::format("max_speed_deg_s = {}\n", toml_number(axis.max_speed_rad_s * kDegPerRad))
              : "") +
         (axis.mass_kg > 0.0
              ? fmt::format("mass_kg = {}\ncom_mm = [{}, {}, {}]\n", toml_number(axis.mass_kg),
                            toml_number(axis.com_m.x() * kMmPerM),
                            toml_number(axis.com_m.y() * kMmPerM),
                            toml_number(axis.com_m.z() * kMmPerM))
              : "") +
         fmt::format("compliance_sigma_rad_per_nm = {}\nbearing_sigma_rad_per_nm = {}\n",
                     toml_number(axis.compliance_sigma_rad_per_nm),
                     toml_number(axis.bearing_sigma_rad_per_nm)) +
         frame_lines(axis.frame);
}

}  // namespace

Robot read_robot(const TomlTable& document) {
  document.word("format", {kRobotFormat});
  Robot robot;
  robot.name = document.string("name");
  robot.source = document.text_or("source", "");
  robot.absolute_accuracy = read_accuracy(document);
  const auto gravity = document.numbers("gravity", 3, {-100.0, 100.0});
  robot.gravity_m_s2 = Eigen::Vector3d(gravity[0], gravity[1], gravity[2]);
  constexpr double kLeastGravity = 0.1;  // a smaller vector has no defined direction
  if (const double size = robot.gravity_m_s2.norm(); size > 0.0 && size < kLeastGravity)
    document.fail("gravity", fmt::format("is {:g} m/s^2 long; state it as [0.0, 0.0, -9.81], or as "
                                         "[0.0, 0.0, 0.0] where there is none",
                                         size));
  const TomlTable tolerance = document.table("tolerance");
  const double length_m = tolerance.number("length_mm", kToleranceMm) / kMmPerM;
  const double angle_rad = tolerance.number("angle_deg", kToleranceDeg) * kRadPerDeg;
  tolerance.refuse_unknown();
  const auto joints = document.tables("joint");
  if (joints.empty() || joints.size() > kMostJointsInFile)
    document.fail(
        "", "a robot needs 1 to 32 [[joint]] tables, but has " + std::to_string(joints.size()));
  std::set<std::string> names;
  for (const TomlTable& table : joints) {
    robot.joints.push_back(read_joint(table, length_m, angle_rad));
    if (!names.insert(robot.joints.back().name).second)
      table.fail("name", "\"" + shown(robot.joints.back().name) + "\" occurs twice");
    if (robot.joints.back().is_prismatic() && (robot.joints.size() > 1 || joints.size() == 1))
      table.fail("kind",
                 "only the first joint may be prismatic: a linear unit that carries the arm");
  }
  read_positioner(document, names, robot);
  robot.base_fixed = read_frame(document.table_or_empty("base"));
  robot.flange_fixed = read_frame(document.table_or_empty("flange"));
  constexpr double kTinyArmM = 0.02;
  double reach_m = robot.base_fixed.translation().norm() + robot.flange_fixed.translation().norm();
  for (const Joint& joint : robot.joints) reach_m += std::abs(joint.d_m) + std::abs(joint.a_m);
  if (robot.joints.size() > 2 && reach_m > 0.0 && reach_m < kTinyArmM)
    document.fail(
        "joint",
        fmt::format(
            "d_mm and a_mm of all, [base] and [flange] are {:.3g} mm together; give them in "
            "millimetres, not in metres",
            reach_m * kMmPerM));
  document.refuse_unknown();
  return robot;
}

std::string robot_to_toml(const Robot& robot) {
  const auto& g = robot.gravity_m_s2;
  std::string accuracy;
  for (const auto& [word, value] : kAccuracyNames)
    if (value == robot.absolute_accuracy)
      accuracy = fmt::format("absolute_accuracy = \"{}\"\n", word);
  // [tolerance] is only the joints' default; the first joint's value is written.
  const Joint& first = robot.joints[robot.first_turning()];
  std::string out = fmt::format(
      "format = \"{}\"\nname = {}\nsource = {}\ngravity = [{}, {}, {}]\n{}\n"
      "[tolerance]\nlength_mm = {}\nangle_deg = {}\n",
      kRobotFormat, toml_string(robot.name), toml_string(robot.source), toml_number(g.x()),
      toml_number(g.y()), toml_number(g.z()), accuracy,
      toml_number(first.tolerance_length_m * kMmPerM),
      toml_number(first.tolerance_angle_rad * kDegPerRad));
  for (const Joint& j : robot.joints) {
    if (j.is_prismatic()) {
      out += prismatic_to_toml(j);
      continue;
    }
    std::string errors;
    for (const JointError error : j.errors)
      for (const auto& [word, value] : kErrorNames)
        if (value == error) errors += fmt::format("{}\"{}\"", errors.empty() ? "" : ", ", word);
    out += fmt::format(
        "\n[[joint]]\nname = {}\nsign = {}\noffset_deg = {}\nd_mm = {}\na_mm = {}\n"
        "alpha_deg = {}\nbeta_deg = {}\nerrors = [{}]\nmin_deg = {}\nmax_deg = {}\n",
        toml_string(j.name), j.sign, toml_number(j.offset_rad * kDegPerRad),
        toml_number(j.d_m * kMmPerM), toml_number(j.a_m * kMmPerM),
        toml_number(j.alpha_rad * kDegPerRad), toml_number(j.beta_rad * kDegPerRad), errors,
        toml_number(j.min_rad * kDegPerRad), toml_number(j.max_rad * kDegPerRad));
    if (j.max_speed_rad_s > 0.0)
      out += fmt::format("max_speed_deg_s = {}\n", toml_number(j.max_speed_rad_s * kDegPerRad));
    if (j.tolerance_length_m != first.tolerance_length_m)
      out += fmt::format("tolerance_length_mm = {}\n", toml_number(j.tolerance_length_m * kMmPerM));
    if (j.tolerance_angle_rad != first.tolerance_angle_rad)
      out += fmt::format("tolerance_angle_deg = {}\n",
                         toml_number(j.tolerance_angle_rad * kDegPerRad));
    if (j.mass_kg > 0.0 || !j.com_m.isZero(0.0))
      out += fmt::format("mass_kg = {}\ncom_mm = [{}, {}, {}]\n", toml_number(j.mass_kg),
                         toml_number(j.com_m.x() * kMmPerM), toml_number(j.com_m.y() * kMmPerM),
                         toml_number(j.com_m.z() * kMmPerM));
    if (j.compliance_sigma_rad_per_nm > 0.0)
      out += fmt::format("compliance_sigma_rad_per_nm = {}\n",
                         toml_number(j.compliance_sigma_rad_per_nm));
    if (j.gear_ratio != 1.0) out += fmt::format("gear_ratio = {}\n", toml_number(j.gear_ratio));
    if (!j.harmonics.empty())
      out += fmt::format("harmonics = [{}]\n", fmt::join(j.harmonics, ", "));
    if (j.harmonic_sigma_rad > 0.0)
      out += fmt::format("harmonic_sigma_arcsec = {}\n",
                         toml_number(j.harmonic_sigma_rad / kRadPerArcsec));
    if (j.harmonic_falloff > 0.0)
      out += fmt::format("harmonic_falloff = {}\n", toml_number(j.harmonic_falloff));
    if (j.bearing_sigma_rad_per_nm > 0.0)
      out +=
          fmt::format("bearing_sigma_rad_per_nm = {}\n", toml_number(j.bearing_sigma_rad_per_nm));
    if (j.counterbalance_sigma_rad > 0.0)
      out += fmt::format("counterbalance_sigma_arcsec = {}\n",
                         toml_number(j.counterbalance_sigma_rad / kRadPerArcsec));
    if (j.stiffening_sigma_rad > 0.0)
      out += fmt::format("stiffening_sigma_arcsec = {}\nstiffening_nm = {}\n",
                         toml_number(j.stiffening_sigma_rad / kRadPerArcsec),
                         toml_number(j.stiffening_nm));
    if (j.function_sigma_rad > 0.0)
      out += fmt::format("function_sigma_arcsec = {}\nfunction_reach_deg = {}\n",
                         toml_number(j.function_sigma_rad / kRadPerArcsec),
                         toml_number(j.function_reach_rad * kDegPerRad));
    if (j.function_fast_sigma_rad > 0.0)
      out += fmt::format("function_fast_sigma_arcsec = {}\n",
                         toml_number(j.function_fast_sigma_rad / kRadPerArcsec));
    if (!j.waves.empty()) out += waves_to_toml(j.waves);
    if (j.function_min_rad < j.function_max_rad)
      out += fmt::format("function_deg = [{}, {}]\n", toml_number(j.function_min_rad * kDegPerRad),
                         toml_number(j.function_max_rad * kDegPerRad));
    if (j.radius_m > 0.0) out += fmt::format("radius_mm = {}\n", toml_number(j.radius_m * kMmPerM));
  }
  out += frame_table("base", robot.base_fixed) + frame_table("flange", robot.flange_fixed);
  for (const PositionerAxis& axis : robot.positioner) out += axis_to_toml(axis);
  return out;
}

Robot load_robot(const std::filesystem::path& path) { return read_robot(TomlTable::load(path)); }

namespace {

/// Path of the binary that contains this code: the shared library, otherwise the program.
std::filesystem::path own_file() {
  std::error_code none;
  Dl_info info{};
  static const int here = 0;
  if (dladdr(&here, &info) != 0 && info.dli_fname != nullptr) {
    // For the program itself this is argv[0], which is not valid from another directory.
    const std::filesystem::path file = info.dli_fname;
    if (file.is_absolute() && file.string().find(".so") != std::string::npos) return file;
  }
  return std::filesystem::read_symlink("/proc/self/exe", none);
}

bool holds_robots(const std::filesystem::path& folder) {
  std::error_code none;
  for (std::filesystem::directory_iterator at(folder, none), end; !none && at != end;
       at.increment(none)) {
    if (at->path().extension() == ".toml") return true;
  }
  return false;
}

std::string nowhere_of(const std::string& name) { return "no robot file \"" + shown(name) + "\""; }

std::string list_of(const std::vector<std::filesystem::path>& places) {
  constexpr std::size_t kShownPath = 300;
  std::string list;
  for (const auto& path : places) list += "\n  " + shown(path.string(), kShownPath);
  return list;
}

}  // namespace

std::vector<std::filesystem::path> robots_directories() {
  std::vector<std::filesystem::path> result;
  if (const char* set = std::getenv("CELLCAL_ROBOTS"); set != nullptr && *set != '\0')
    result.emplace_back(set);
  const std::array<std::filesystem::path, 2> places = {"share/cellcal/robots", "calib/robots"};
  const std::filesystem::path file = own_file();
  for (auto folder = file.parent_path(); folder.has_relative_path();
       folder = folder.parent_path()) {
    for (const auto& place : places) {
      if (holds_robots(folder / place)) result.push_back(folder / place);
    }
  }
  const std::filesystem::path usual = "/usr/share/cellcal/robots";
  if (result.empty() || result.back() != usual) result.push_back(usual);
  return result;
}

UnknownRobot::UnknownRobot(std::string asked_for, std::vector<std::filesystem::path> places)
    : FileError(nowhere_of(asked_for) + "; looked for" + list_of(places)),
      name(std::move(asked_for)),
      searched(std::move(places)) {}

std::string UnknownRobot::nowhere() const { return nowhere_of(name); }

std::filesystem::path find_robot_file(const std::string& name,
                                      const std::filesystem::path& folder) {
  const std::filesystem::path given(name);
  std::vector<std::filesystem::path> tried{folder / given};  // an absolute path stays absolute
  for (const auto& directory : robots_directories()) {
    tried.push_back(directory / given);
    if (given.extension() != ".toml") tried.push_back(directory / (name + ".toml"));
  }
  for (const auto& path : tried) {
    std::error_code ignored;  // an unreadable path counts as missing; the message lists it
    if (std::filesystem::is_regular_file(path, ignored)) return path;
  }
  throw UnknownRobot(name, std::move(tried));
}

std::vector<NamedRobot> shipped_robots() {
  std::vector<NamedRobot> robots;
  for (const std::filesystem::path& folder : robots_directories()) {
    std::error_code none;
    for (std::filesystem::directory_iterator at(folder, none), end; !none && at != end;
         at.increment(none)) {
      const auto& entry = *at;
      if (entry.path().extension() != ".toml") continue;
      try {
        robots.push_back({entry.path().stem().string(), load_robot(entry.path())});
      } catch (const FileError&) {
        continue;
      }
    }
    if (!robots.empty()) break;  // further directories hold the same files
  }
  return robots;
}

namespace {

/// Omits the minus sign of values that round to zero.
std::string fixed(double value, int decimals) {
  std::string text = fmt::format("{:.{}f}", value, decimals);
  if (text.find_first_not_of("-0.") == std::string::npos && text.front() == '-') text.erase(0, 1);
  return text + ' ';
}

std::string drawn_mm(double m) { return fixed(m * kMmPerM, 6); }
std::string nine_decimals(double value) { return fixed(value, 9); }
std::string deg(double rad) { return nine_decimals(rad * kDegPerRad); }

std::string frame(const Eigen::Isometry3d& f) {
  std::string text =
      drawn_mm(f.translation().x()) + drawn_mm(f.translation().y()) + drawn_mm(f.translation().z());
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) text += nine_decimals(f.linear()(row, column));
  return text + '\n';
}

}  // namespace

std::string nominal_geometry_sha256(const Robot& robot) {
  std::string text = frame(robot.base_fixed);
  for (const Joint& j : robot.joints) {
    text += fmt::format("{} {} ", j.name, j.sign);
    if (j.guide)
      for (const double component : j.guide->along) text += nine_decimals(component);
    text +=
        deg(j.offset_rad) + drawn_mm(j.d_m) + drawn_mm(j.a_m) + deg(j.alpha_rad) + deg(j.beta_rad);
    std::vector<JointError> errors = j.errors;
    std::sort(errors.begin(), errors.end());
    for (const JointError error : errors) text += fmt::format("{} ", static_cast<int>(error));
    text += '\n';
  }
  return sha256(text + frame(robot.flange_fixed));
}

}  // namespace cellcal::calib
