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
#include "calib/model/enum_table.h"
#include "calib/model/kinematics.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

constexpr std::string_view kRobotFormat = "cellcal.robot/1";
constexpr std::size_t kMostJointsInFile = 32;
constexpr Range kToleranceMm{0.0, 1e3};
constexpr Range kToleranceDeg{0.0, 90.0};
constexpr Range kPerMille{0.0, 100.0};
constexpr Range kSpeed{1e-3, 1e5};
constexpr Range kRadPerNm{0.0, 1.0};
constexpr Range kSigmaArcsec{0.0, 1e5};
constexpr Range kReachDeg{0.1, 180.0};

using J = Joint;
using A = PositionerAxis;
using G = LinearGuide;

constexpr NumberKey<J> kStroke[] = {{"min_mm", &J::min_rad, kMilli, kLengthMm, kNeeded},
                                    {"max_mm", &J::max_rad, kMilli, kLengthMm, kNeeded},
                                    {"max_speed_mm_s", &J::max_speed_rad_s, kMilli, kSpeed}};

constexpr NumberKey<G> kGuide[] = {
    {"scale_sigma_mm_per_m", &G::scale_sigma, kMilli, kPerMille, kAlways},
    {"direction_sigma_mrad", &G::direction_sigma_rad, kMilli, kPerMille, kAlways},
    {"straightness_sigma_mm", &G::straightness_sigma_m, kMilli, kToleranceMm, kAlways},
    {"turn_sigma_mrad_per_m", &G::turn_sigma_rad_m, kMilli, kPerMille, kAlways},
    {"turn_sigma_mrad", &G::turn_sigma_rad, kMilli, kPerMille, kAlways}};

constexpr NumberKey<J> kGeometry[] = {{"offset_deg", &J::offset_rad, kDeg, kAngleDeg, kAlways},
                                      {"d_mm", &J::d_m, kMilli, kLengthMm, kNeeded},
                                      {"a_mm", &J::a_m, kMilli, kLengthMm, kNeeded},
                                      {"alpha_deg", &J::alpha_rad, kDeg, kAngleDeg, kNeeded},
                                      {"beta_deg", &J::beta_rad, kDeg, kAngleDeg, kAlways}};

constexpr NumberKey<J> kTravel[] = {
    {"min_deg", &J::min_rad, kDeg, kAngleDeg, kNeeded},
    {"max_deg", &J::max_rad, kDeg, kAngleDeg, kNeeded},
    {"max_speed_deg_s", &J::max_speed_rad_s, kDeg, kSpeed},
    {"tolerance_length_mm", &J::tolerance_length_m, kMilli, kToleranceMm},
    {"tolerance_angle_deg", &J::tolerance_angle_rad, kDeg, kToleranceDeg}};

constexpr NumberKey<J> kGear[] = {
    {"compliance_sigma_rad_per_nm", &J::compliance_sigma_rad_per_nm, kSi, kRadPerNm},
    {"gear_ratio", &J::gear_ratio, kSi, {-1e4, 1e4}},
    {"harmonic_sigma_arcsec", &J::harmonic_sigma_rad, kArcsec, kSigmaArcsec},
    {"harmonic_falloff", &J::harmonic_falloff, kSi, {0.0, 10.0}},
    {"bearing_sigma_rad_per_nm", &J::bearing_sigma_rad_per_nm, kSi, kRadPerNm},
    {"counterbalance_sigma_arcsec", &J::counterbalance_sigma_rad, kArcsec, kSigmaArcsec},
    {"stiffening_sigma_arcsec", &J::stiffening_sigma_rad, kArcsec, kSigmaArcsec},
    {"stiffening_nm", &J::stiffening_nm, kSi, {1.0, 1e6}, kIfOther, &J::stiffening_sigma_rad},
    {"function_sigma_arcsec", &J::function_sigma_rad, kArcsec, kSigmaArcsec},
    {"function_reach_deg", &J::function_reach_rad, kDeg, kReachDeg, kIfOther,
     &J::function_sigma_rad},
    {"function_fast_sigma_arcsec", &J::function_fast_sigma_rad, kArcsec, kSigmaArcsec},
    {"radius_mm", &J::radius_m, kMilli, {1.0, 5e3}}};

constexpr NumberKey<A> kAxis[] = {
    {"min_deg", &A::min_rad, kDeg, kAngleDeg, kNeeded},
    {"max_deg", &A::max_rad, kDeg, kAngleDeg, kNeeded},
    {"max_speed_deg_s", &A::max_speed_rad_s, kDeg, kSpeed},
    {"place_sigma_mm", &A::place_sigma_m, kMilli, kToleranceMm, kAlways},
    {"direction_sigma_mrad", &A::direction_sigma_rad, kMilli, kPerMille, kAlways},
    {"scale_sigma_mrad_per_rad", &A::scale_sigma, kMilli, kPerMille, kAlways},
    {"compliance_sigma_rad_per_nm", &A::compliance_sigma_rad_per_nm, kSi, kRadPerNm, kAlways},
    {"bearing_sigma_rad_per_nm", &A::bearing_sigma_rad_per_nm, kSi, kRadPerNm, kAlways}};

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
  return std::ranges::find(kAccuracyNames, stated,
                           &std::pair<std::string_view, AbsoluteAccuracy>::first)
      ->second;
}

Eigen::Isometry3d read_frame_table(const TomlTable& table) {
  const Eigen::Isometry3d frame = read_frame(table, false);
  table.refuse_unknown();
  return frame;
}

std::string read_joint_name(const TomlTable& t) {
  const std::string name = t.string("name");
  if (name.empty() || name.find_first_of(", \t\r\n\"#") != std::string::npos)
    t.fail("name", "must be a word without spaces, commas or quotes: it names a CSV column");
  if (std::ranges::find(kTouchColumns, name) != std::end(kTouchColumns))
    t.fail("name", "must not be \"" + name + "\": a column of touches is named so");
  return name;
}

/// A linear unit's.
Joint read_prismatic(const TomlTable& t) {
  Joint joint;
  joint.name = read_joint_name(t);
  LinearGuide& guide = joint.guide.emplace(usual_guide());
  guide.along = read_vector(t, "along", {-1.0, 1.0});
  constexpr double kUnitSlack = 0.01;
  if (std::abs(guide.along.norm() - 1.0) > kUnitSlack)
    t.fail("along", "must be a direction of length 1, as in [0.0, 1.0, 0.0]");
  guide.along.normalize();
  read_numbers(t, kStroke, joint);
  constexpr double kShortestM = 0.05;  // shorter strokes are given in metres
  if (joint.max_rad - joint.min_rad < kShortestM)
    t.fail("min_mm", "must be at least 50 mm less than max_mm");
  read_numbers(t, kGuide, guide);
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

int read_sign(const TomlTable& t) {
  const long sign = t.integer_or("sign", 1, -1, 1);
  if (sign == 0) t.fail("sign", "must be 1 or -1");
  return static_cast<int>(sign);
}

/// `joint` holds the usual values.
Joint read_turning(const TomlTable& t, Joint joint) {
  joint.name = read_joint_name(t);
  joint.sign = read_sign(t);
  read_numbers(t, kGeometry, joint);
  for (const std::string& word : t.strings("errors")) {
    const auto error = by_own_name<JointError>(word);
    if (!error)
      t.fail("errors", "\"" + shown(word) + "\" is not known; use theta, d, a, alpha, beta");
    if (std::ranges::find(joint.errors, *error) != joint.errors.end())
      t.fail("errors", "\"" + word + "\" occurs twice");
    joint.errors.push_back(*error);
  }
  read_numbers(t, kTravel, joint);
  if (joint.min_rad >= joint.max_rad) t.fail("min_deg", "must be less than max_deg");
  read_mass(t, joint.mass_kg, joint.com_m);
  joint.harmonics = read_orders(t, "harmonics", {1.0, 1000.0}, kMostHarmonics);
  read_numbers(t, kGear, joint);
  joint.waves = read_waves(t);
  if (t.has("function_deg")) {
    const auto range = t.numbers("function_deg", 2, kAngleDeg);
    if (!(range[0] < range[1])) t.fail("function_deg", "must hold the smaller angle first");
    joint.function_min_rad = range[0] * kRadPerDeg;
    joint.function_max_rad = range[1] * kRadPerDeg;
  }
  t.refuse_unknown();
  return joint;
}

PositionerAxis read_positioner_axis(const TomlTable& t) {
  PositionerAxis axis = usual_positioner_axis();
  axis.name = read_joint_name(t);
  axis.sign = read_sign(t);
  read_numbers(t, kAxis, axis);
  if (axis.min_rad >= axis.max_rad) t.fail("min_deg", "must be less than max_deg");
  read_mass(t, axis.mass_kg, axis.com_m);
  axis.frame = read_frame_table(t);
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

Joint read_joint(const TomlTable& t, const Joint& usual) {
  const bool prismatic = t.has("kind") && t.word("kind", {"revolute", "prismatic"}) == "prismatic";
  return prismatic ? read_prismatic(t) : read_turning(t, usual);
}

std::string prismatic_to_toml(const Joint& j) {
  return fmt::format("\n[[joint]]\nname = {}\nkind = \"prismatic\"\nalong = {}\n",
                     toml_string(j.name), vector_to_toml(j.guide->along)) +
         numbers_to_toml(kStroke, j) + numbers_to_toml(kGuide, *j.guide);
}

std::string frame_table(const char* name, const Eigen::Isometry3d& isometry) {
  if (isometry.isApprox(Eigen::Isometry3d::Identity(), 0.0)) return {};
  return fmt::format("\n[{}]\n", name) + frame_to_toml(isometry);
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

std::string turning_to_toml(const Joint& j, const Joint& usual) {
  std::string errors;
  for (const JointError error : j.errors)
    errors += fmt::format("{}\"{}\"", errors.empty() ? "" : ", ", own_name(error));
  std::string out =
      fmt::format("\n[[joint]]\nname = {}\nsign = {}\n{}errors = [{}]\n", toml_string(j.name),
                  j.sign, numbers_to_toml(kGeometry, j), errors) +
      numbers_to_toml(kTravel, j, usual);
  if (j.mass_kg > 0.0 || !j.com_m.isZero(0.0)) out += mass_to_toml(j.mass_kg, j.com_m);
  if (!j.harmonics.empty()) out += fmt::format("harmonics = [{}]\n", fmt::join(j.harmonics, ", "));
  out += numbers_to_toml(kGear, j);
  if (!j.waves.empty()) out += waves_to_toml(j.waves);
  if (j.function_min_rad < j.function_max_rad)
    out += fmt::format("function_deg = [{}, {}]\n", toml_number(j.function_min_rad * kDegPerRad),
                       toml_number(j.function_max_rad * kDegPerRad));
  return out;
}

std::string axis_to_toml(const PositionerAxis& axis) {
  return fmt::format("\n[[positioner]]\nname = {}\nsign = {}\n", toml_string(axis.name),
                     axis.sign) +
         numbers_to_toml(kAxis, axis) +
         (axis.mass_kg > 0.0 ? mass_to_toml(axis.mass_kg, axis.com_m) : "") +
         frame_to_toml(axis.frame);
}

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

LinearGuide usual_guide() {
  LinearGuide guide;
  guide.scale_sigma = 0.5e-3;
  guide.direction_sigma_rad = 3e-3;
  guide.straightness_sigma_m = 0.3e-3;
  guide.turn_sigma_rad_m = 0.5e-3;
  guide.turn_sigma_rad = 0.3e-3;
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

Robot read_robot(const TomlTable& document) {
  document.word("format", {kRobotFormat});
  Robot robot;
  robot.name = document.string("name");
  robot.source = document.text_or("source", "");
  robot.absolute_accuracy = read_accuracy(document);
  robot.gravity_m_s2 = read_vector(document, "gravity", {-100.0, 100.0});
  constexpr double kLeastGravity = 0.1;  // a smaller vector has no defined direction
  if (const double size = robot.gravity_m_s2.norm(); size > 0.0 && size < kLeastGravity)
    document.fail("gravity", fmt::format("is {:g} m/s^2 long; state it as [0.0, 0.0, -9.81], or as "
                                         "[0.0, 0.0, 0.0] where there is none",
                                         size));
  const TomlTable tolerance = document.table("tolerance");
  Joint usual;
  usual.tolerance_length_m = tolerance.number("length_mm", kToleranceMm) / kMmPerM;
  usual.tolerance_angle_rad = tolerance.number("angle_deg", kToleranceDeg) * kRadPerDeg;
  usual.function_reach_rad = 5.0 * kRadPerDeg;
  tolerance.refuse_unknown();
  const auto joints = document.tables("joint");
  if (joints.empty() || joints.size() > kMostJointsInFile)
    document.fail(
        "", "a robot needs 1 to 32 [[joint]] tables, but has " + std::to_string(joints.size()));
  std::set<std::string> names;
  for (const TomlTable& table : joints) {
    robot.joints.push_back(read_joint(table, usual));
    if (!names.insert(robot.joints.back().name).second)
      table.fail("name", "\"" + shown(robot.joints.back().name) + "\" occurs twice");
    if (robot.joints.back().is_prismatic() && (robot.joints.size() > 1 || joints.size() == 1))
      table.fail("kind",
                 "only the first joint may be prismatic: a linear unit that carries the arm");
  }
  read_positioner(document, names, robot);
  robot.base_fixed = read_frame_table(document.table_or_empty("base"));
  robot.flange_fixed = read_frame_table(document.table_or_empty("flange"));
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
  std::string accuracy;
  for (const auto& [word, value] : kAccuracyNames)
    if (value == robot.absolute_accuracy)
      accuracy = fmt::format("absolute_accuracy = \"{}\"\n", word);
  // [tolerance] is only the joints' default; the first joint's value is written.
  const Joint& first = robot.joints[robot.first_turning()];
  std::string out = fmt::format(
      "format = \"{}\"\nname = {}\nsource = {}\ngravity = {}\n{}\n"
      "[tolerance]\nlength_mm = {}\nangle_deg = {}\n",
      kRobotFormat, toml_string(robot.name), toml_string(robot.source),
      vector_to_toml(robot.gravity_m_s2), accuracy, toml_number(first.tolerance_length_m * kMmPerM),
      toml_number(first.tolerance_angle_rad * kDegPerRad));
  Joint usual;
  usual.tolerance_length_m = first.tolerance_length_m;
  usual.tolerance_angle_rad = first.tolerance_angle_rad;
  for (const Joint& j : robot.joints)
    out += j.is_prismatic() ? prismatic_to_toml(j) : turning_to_toml(j, usual);
  out += frame_table("base", robot.base_fixed) + frame_table("flange", robot.flange_fixed);
  for (const PositionerAxis& axis : robot.positioner) out += axis_to_toml(axis);
  return out;
}

Robot load_robot(const std::filesystem::path& path) { return read_robot(TomlTable::load(path)); }

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
