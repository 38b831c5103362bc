#include "calib/export/machine_data.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <numbers>

#include "calib/files/text.h"
#include "calib/model/error.h"
#include "calib/model/kinematics.h"

namespace cellcal::calib {

namespace {

using krl::Aggregate;
using krl::Given;
using krl::Token;

constexpr double kSame = 1e-5;  // m
constexpr double kLargestMm = 1e5, kLargestDeg = 1e5, kLargestRpm = 1e6, kLargestTurns = 1e15;

/// One value, for messages.
struct Place {
  const std::string& file;
  const krl::Line& line;
  const Given& given;
  std::string text() const { return fmt::format("{}:{}", file, line.number); }
  [[noreturn]] void fail(const std::string& what) const {
    throw FileError(file,
                    fmt::format(":{}: {} is not {}", line.number, shown(given.element()), what));
  }
  double real(double largest) const {
    const auto value = krl::read_number(line.tokens, given.value);
    if (!value || std::abs(*value) > largest) fail(fmt::format("a number up to {}", largest));
    return *value;
  }
  Aggregate structure() const {
    const auto value = krl::read_aggregate(line.tokens, given.value);
    if (!value) fail("a structure {...} of finite numbers");
    return *value;
  }
  double member(const Aggregate& of, const char* key, double largest) const {
    const auto at = of.numbers.find(key);
    if (at == of.numbers.end() || !(std::abs(at->second.value) <= largest))
      fail(fmt::format("a structure with {} up to {}", key, largest));
    return at->second.value;
  }
  FrameMmDeg frame() const {
    const Aggregate all = structure();
    FrameMmDeg result;
    constexpr const char* kNames[] = {"X", "Y", "Z", "A", "B", "C"};
    for (std::size_t i = 0; i < 3; ++i) {
      result.xyz_mm[i] = member(all, kNames[i], kLargestMm);
      result.abc_deg[i] = member(all, kNames[i + 3], kLargestDeg);
    }
    return result;
  }
  /// "#STANDARD", "FALSE", "6", a text without its quotes.
  std::string word() const {
    const Token& token = line.tokens[given.value];
    if (token.kind == Token::Kind::kNumber) return fmt::format("{}", token.value);
    std::string text = token.word;
    std::erase(text, '"');
    return shown(text, 80);
  }
};

/// Motor turns per minute, in the order in which a file has them.
using Drives = std::array<double, 6>;

void of_axis(const Place& place, MachineData& data, Drives& rpm) {
  const auto i = static_cast<std::size_t>(place.given.index - 1);
  const std::string& name = place.given.name;
  MachineAxis& axis = data.axes[i];
  if (name == "$SOFTN_END") axis.min_rad = place.real(kLargestDeg) * kRadPerDeg;
  if (name == "$SOFTP_END") axis.max_rad = place.real(kLargestDeg) * kRadPerDeg;
  if (name == "$MAMES") axis.mastering_rad = place.real(kLargestDeg) * kRadPerDeg;
  if (name == "$AXIS_DIR") axis.sense = place.real(1.0) < 0.0 ? -1 : 1;
  if (name == "$VEL_AXIS_MA") rpm[i] = std::abs(place.real(kLargestRpm));
  if (name == "$RAT_MOT_AX") {
    const Aggregate ratio = place.structure();
    const double turns = place.member(ratio, "D", kLargestTurns);
    if (turns == 0.0) place.fail("a ratio: D is 0");
    axis.gear_ratio = std::abs(place.member(ratio, "N", kLargestTurns) / turns);
  }
  if (rpm[i] > 0.0 && axis.gear_ratio.value_or(0.0) > 0.0)
    axis.max_speed_rad_s = rpm[i] / 60.0 / *axis.gear_ratio * kRadPerTurn;
}

/// The form of such a value, for messages.
std::string form_of(const krl::Given& given) {
  if (given.index >= 0) return "a number in its range";
  if (given.name == "$EX_AX_NUM") return "a whole number from 0 to 6";
  const bool words = given.name == "$EX_KIN" || given.name.ends_with("_AX");
  return words ? "a structure {...} of names" : "a structure with X, Y, Z, A, B, C";
}

/// Properties of other kinds of arms, with the value of a six-axis arm.
constexpr std::pair<const char*, const char*> kUsual[] = {
    {"$KINCLASS", "#STANDARD"}, {"$MAIN_AXIS", "#NR"}, {"$A4PAR", "0"},  {"$DEF_A4FIX", "FALSE"},
    {"$DEF_A5LINK", "FALSE"},   {"$TRAFO_AXIS", "6"},  {"$SPINDLE", "0"}};

std::optional<FrameMmDeg>* frame_named(const std::string& name, MachineData& data) {
  if (name == "$TIRORO") return &data.base;
  if (name == "$TX3P3") return &data.wrist;
  return name == "$TFLWP" ? &data.flange : nullptr;
}

AbsoluteAccuracy accuracy_of(const Place& place) {
  const std::string word = place.word();
  for (const char* active : {"TRUE", "#ACTIVATED", "#ACTIVE"})
    if (word == active) return AbsoluteAccuracy::kActive;
  for (const char* off : {"FALSE", "#SUPPRESSED", "#INACTIVE", "#NONE"})
    if (word == off) return AbsoluteAccuracy::kOff;
  place.fail("TRUE, FALSE, #ACTIVATED, #SUPPRESSED or #NONE");
}

void apply_accuracy(const Place& place, MachineData& data) {
  const std::string& name = place.given.name;
  if (name == "$ABS_ACCUR" || name == "ABS_ACCUR") data.stated_accuracy = accuracy_of(place);
  if (name == "$DEACTIVATE_ABS_ACCUR" || name == "$SUPPRESS_ABS_ACCUR")
    data.accuracy_deactivated |= place.word() == "TRUE";
}

void take_arm(const Place& place, MachineData& data, Drives& rpm) {
  const std::string& name = place.given.name;
  if (place.given.index >= 1) {
    if (place.given.index <= 6) of_axis(place, data, rpm);
    return;
  }
  if (name.starts_with('$')) data.places[name] = place.text();
  if (auto* frame = frame_named(name, data)) *frame = place.frame();
  if (name == "$LENGTH_A") data.length_a_m = place.real(kLargestMm) / kMmPerM;
  if (name == "$LENGTH_B") data.length_b_m = place.real(kLargestMm) / kMmPerM;
  if (name == "$DH_4" || name == "$DH_5") {
    const Aggregate link = place.structure();
    data.hand[name == "$DH_4" ? 0 : 1] = HandLink{place.member(link, "DHART_A", kLargestMm),
                                                  place.member(link, "DHART_D", kLargestMm),
                                                  place.member(link, "DHART_ALPHA", kLargestDeg)};
  }
  if (name == "$TRAFONAME") data.trafo_name = place.word();
  if (name == "$MODEL_NAME") data.model_name = place.word();
  if (name == "$INDIVIDUAL_MAMES") data.marks_in_arm = place.word() != "#NONE";
  apply_accuracy(place, data);
  for (const auto& [variable, usual] : kUsual)
    if (name == variable) data.kinds[name] = place.word();
}

void take(const Place& place, MachineData& data, Drives& rpm) {
  const std::string& name = place.given.name;
  const auto frames = krl::read_controller_frames(place.line, data);
  if (frames == krl::Stated::kUnreadable)
    place.fail("a structure with " +
               std::string(name == "LOAD_DATA" ? "M and CM" : "X, Y, Z, A, B, C"));
  if (frames == krl::Stated::kOther) place.fail(krl::kStatedBefore);
  if (name == "TOOL_DATA") data.tool_places[place.given.index] = place.text();
  if (frames == krl::Stated::kValue) return;
  const auto external = read_external_axes(place.line, data.external);
  if (external == krl::Stated::kUnreadable) place.fail(form_of(place.given));
  if (external == krl::Stated::kNothing) take_arm(place, data, rpm);
}

/// Standard kinematics: the first axis down, 2, 3 and 5 as positive turns about +y, 4 and 6 against +x.
constexpr std::array<int, 6> kSigns = {-1, 1, 1, -1, 1, -1};
/// $AXIS_DIR of such an arm, whose hand KUKA describes with the other turn of axis 5.
constexpr std::array<int, 6> kSenses = {-1, 1, 1, -1, -1, -1};

std::string place_of(const MachineData& data, const std::string& variable) {
  const auto at = data.places.find(variable);
  return at == data.places.end() ? "" : at->second + ": ";
}

[[noreturn]] void refuse_arm(const MachineData& data, const std::string& variable,
                             const std::string& is) {
  throw FileError(place_of(data, variable) + variable + is +
                  ": not a six-axis arm with a spherical wrist. Give its geometry with --robot or "
                  "--urdf");
}

void refuse_other_kinds(const MachineData& data) {
  for (const auto& [variable, usual] : kUsual)
    if (const auto at = data.kinds.find(variable); at != data.kinds.end() && at->second != usual)
      refuse_arm(data, variable, " = " + at->second);
  constexpr std::array<double, 2> kTurns = {90.0, -90.0};
  for (std::size_t i = 0; i < 2; ++i) {
    if (!data.hand[i]) continue;
    const auto& [a, d, alpha] = *data.hand[i];
    if (a != 0.0 || d != 0.0 || alpha != kTurns[i])
      refuse_arm(data, fmt::format("$DH_{}", i + 4),
                 fmt::format(": DHART_A {:.3f} mm, DHART_D {:.3f} mm, DHART_ALPHA {:.3f} deg", a, d,
                             alpha));
  }
}

/// Along z alone, turned by B = turn.
double along_z(const MachineData& data, const std::optional<FrameMmDeg>& frame, const char* name) {
  if (!frame) throw FileError(std::string(name) + ": not in the given machine data");
  const auto& [xyz, abc] = *frame;
  if (xyz[0] != 0.0 || xyz[1] != 0.0 || abc[0] != 0.0 || abc[1] != 0.0 || abc[2] != 0.0)
    refuse_arm(data, name, " is not along Z alone");
  return xyz[2] / kMmPerM;
}

struct WristPlace {
  double along_m = 0.0, above_m = 0.0;
};

WristPlace wrist_of(const MachineData& data) {
  if (!data.wrist) throw FileError("$TX3P3: not in the given machine data");
  const auto& [xyz, abc] = *data.wrist;
  if (xyz[1] != 0.0 || abc[0] != 0.0 || abc[1] != 90.0 || abc[2] != 0.0)
    refuse_arm(data, "$TX3P3", " is not {X ..,Y 0,Z ..,A 0,B 90,C 0}");
  return {xyz[0] / kMmPerM, xyz[2] / kMmPerM};
}

void check_axis(const MachineAxis& axis, std::size_t number) {
  if (!axis.min_rad || !axis.max_rad || !(*axis.min_rad < *axis.max_rad))
    throw FileError(fmt::format(
        "axis {}: $SOFTN_END and $SOFTP_END are not both in the given machine data, one below the "
        "other",
        number));
}

Robot standard_arm(const MachineData& data) {
  constexpr double kQuarter = std::numbers::pi / 2;
  if (!data.length_a_m || !data.length_b_m)
    throw FileError("$LENGTH_A, $LENGTH_B: not in the given machine data");
  const WristPlace wrist = wrist_of(data);
  const std::array<double, 6> d = {
      along_z(data, data.base, "$TIRORO"), 0.0, 0.0, wrist.along_m, 0.0,
      along_z(data, data.flange, "$TFLWP")};
  const std::array<double, 6> a = {
      *data.length_a_m, *data.length_b_m, wrist.above_m, 0.0, 0.0, 0.0};
  const std::array<double, 6> alpha = {-kQuarter, 0.0, -kQuarter, kQuarter, -kQuarter, 0.0};
  const std::array<double, 6> offset = {0.0, 0.0, -kQuarter, 0.0, 0.0, std::numbers::pi};
  Robot robot;
  for (std::size_t i = 0; i < 6; ++i) {
    Joint& joint = robot.joints.emplace_back();
    joint.name = "A" + std::to_string(i + 1);
    joint.sign = kSigns[i] * data.axes[i].sense.value_or(kSenses[i]) * kSenses[i];
    joint.d_m = d[i];
    joint.a_m = a[i];
    joint.alpha_rad = alpha[i];
    joint.offset_rad = offset[i];
    joint.errors = {JointError::kTheta, JointError::kD, JointError::kA, JointError::kAlpha};
    if (i == 1)  // parallel to the next
      joint.errors = {JointError::kTheta, JointError::kA, JointError::kAlpha, JointError::kBeta};
    joint.gear_ratio = data.axes[i].gear_ratio.value_or(1.0);
  }
  return robot;
}

/// $TIRORO Z, $LENGTH_A, $LENGTH_B, $TX3P3 Z, $TX3P3 X, $TFLWP Z of an arm of such senses.
struct ArmLengths {
  Eigen::Matrix<double, 6, 1> length_m;
  double off_m = 0.0;  ///< between that arm's flange and the robot's
};

Robot of_lengths(const MachineData& senses, const Eigen::Matrix<double, 6, 1>& length_m) {
  MachineData data;
  data.axes = senses.axes;
  data.base = FrameMmDeg{{0.0, 0.0, length_m[0] * kMmPerM}, {}};
  data.length_a_m = length_m[1];
  data.length_b_m = length_m[2];
  data.wrist = FrameMmDeg{{length_m[4] * kMmPerM, 0.0, length_m[3] * kMmPerM}, {0.0, 90.0, 0.0}};
  data.flange = FrameMmDeg{{0.0, 0.0, length_m[5] * kMmPerM}, {}};
  return standard_arm(data);
}

constexpr int kPostures = 16;

/// The flange at some angles, one below the other.
Eigen::VectorXd flange_places(const Robot& robot) {
  const ArmModel arm(robot, Tool{});
  Eigen::VectorXd all(3 * kPostures);
  for (int k = 0; k < kPostures; ++k) {
    JointVector q;
    for (int i = 0; i < 6; ++i)
      q.push_back(((k >> (i % 4)) & 1) != 0 ? 0.3 + 0.1 * i : -0.4 - 0.1 * i);
    all.segment<3>(3 * k) = arm.nominal_tcp(q).translation();
  }
  return all;
}

/// The robot's lengths as the controller counts them: the flange's place is linear in them.
ArmLengths lengths_of(const Robot& robot, const MachineData& senses) {
  using Lengths = Eigen::Matrix<double, 6, 1>;
  Eigen::Matrix<double, 3 * kPostures, 6> each;
  for (int k = 0; k < 6; ++k) each.col(k) = flange_places(of_lengths(senses, Lengths::Unit(k)));
  const Eigen::VectorXd places = flange_places(robot);
  ArmLengths found;
  found.length_m = each.colPivHouseholderQr().solve(places);
  found.off_m = (each * found.length_m - places).cwiseAbs().maxCoeff();
  return found;
}

/// The arm that A1 to A6 of the controller are.
Robot behind_unit(Robot robot) {
  robot.joints.erase(robot.joints.begin(), robot.joints.begin() + robot.first_turning());
  return robot;
}

/// Payload class of a type such as "#KR210R2700EXC4FLR" in kg; 0: none is named.
int payload_kg(std::string_view type) {
  constexpr std::string_view kSeries = "KR";
  const auto at = type.find(kSeries);
  if (at == std::string_view::npos) return 0;
  type.remove_prefix(std::min(type.size(), type.find_first_not_of(" _", at + kSeries.size())));
  int kg = 0;
  std::from_chars(type.data(), type.data() + type.size(), kg);
  return kg;
}

/// Letters and digits alone: releases write "#KR5 R1400", "#KR5R1400" and "#KR5_R1400 C4".
std::string plain_type(const std::string& type) {
  std::string plain = krl::upper_case(type);
  std::erase_if(plain, [](unsigned char c) { return std::isalnum(c) == 0; });
  return plain;
}

/// Priors of counterbalance and stiffening gears, as in the shipped files of heavy arms.
void add_heavy_priors(Robot& robot) {
  robot.joints[1].counterbalance_sigma_rad = 300.0 * kRadPerArcsec;
  for (const std::size_t i : {1, 2}) {
    robot.joints[i].stiffening_sigma_rad = 60.0 * kRadPerArcsec;
    robot.joints[i].stiffening_nm = 1000.0;
  }
}

}  // namespace

void read_machine_data(std::string_view text, const std::string& name, MachineData& data) {
  Drives rpm{};
  for (const krl::Line& line : krl::read_lines({name, std::string(text)}))
    if (const auto given = krl::read_given(line)) take({name, line, *given}, data, rpm);
}

void read_arm(std::string_view text, const std::string& name, MachineData& data) {
  Drives rpm{};
  for (const krl::Line& line : krl::read_lines({name, std::string(text)}))
    if (const auto given = krl::read_given(line)) take_arm({name, line, *given}, data, rpm);
}

void read_absolute_accuracy(std::string_view text, const std::string& name, MachineData& data) {
  for (const krl::Line& line : krl::read_lines({name, std::string(text)}))
    if (const auto given = krl::read_given(line)) apply_accuracy({name, line, *given}, data);
}

std::string two_robots(const MachineData& data) {
  const std::string &trafo = data.trafo_name, &model = data.model_name;
  const std::string one = plain_type(trafo), other = plain_type(model);
  const bool longer = one.starts_with(other) || other.starts_with(one);  // with options, or cut
  if (one.empty() || other.empty() || (longer && payload_kg(trafo) == payload_kg(model))) return {};
  return fmt::format(
      "{}$TRAFONAME \"{}\", {}$MODEL_NAME \"{}\": two robots. The first counts, whose lengths these are. "
      "Compare the type plate",
      place_of(data, "$TRAFONAME"), trafo, place_of(data, "$MODEL_NAME"), model);
}

Robot robot_of(const MachineData& data) {
  refuse_other_kinds(data);
  for (std::size_t i = 0; i < 6; ++i) check_axis(data.axes[i], i + 1);
  Robot robot = with_machine_data(standard_arm(data), data);
  robot.name = data.type().empty() ? "KUKA" : data.type();
  std::erase(robot.name, '#');
  robot.source = "machine data";
  constexpr int kHeavyKg = 120;  // from here on KUKA's arms have a counterbalance
  if (payload_kg(data.type()) >= kHeavyKg) add_heavy_priors(robot);
  return robot;
}

std::vector<LengthDifference> differences(const MachineData& data, const Robot& robot) {
  const Robot arm = behind_unit(robot);
  if (arm.joints.size() != 6)
    throw FileError(fmt::format("\"{}\" has {} joints; machine data of a six-axis arm are read",
                                arm.name, arm.joints.size()));
  const ArmLengths is = lengths_of(arm, data);
  std::vector<LengthDifference> found;
  const auto hold = [&](const char* variable, const std::optional<double>& stated, const char* key,
                        std::size_t joint, double robot_m) {
    if (stated && !(std::abs(*stated - robot_m) <= kSame))
      found.push_back({variable, arm.joints[joint].name, key, *stated, robot_m});
  };
  const auto of = [](const std::optional<FrameMmDeg>& frame, std::size_t axis) {
    return frame ? std::optional(frame->xyz_mm[axis] / kMmPerM) : std::nullopt;
  };
  hold("$TIRORO X", of(data.base, 0), "base", 0, 0.0);
  hold("$TIRORO Y", of(data.base, 1), "base", 0, 0.0);
  hold("$TIRORO Z", of(data.base, 2), "d_mm", 0, is.length_m[0]);
  hold("$LENGTH_A", data.length_a_m, "a_mm", 0, is.length_m[1]);
  hold("$LENGTH_B", data.length_b_m, "a_mm", 1, is.length_m[2]);
  hold("$TX3P3 Z", of(data.wrist, 2), "a_mm", 2, is.length_m[3]);
  hold("$TX3P3 Y", of(data.wrist, 1), "d_mm", 2, 0.0);
  hold("$TX3P3 X", of(data.wrist, 0), "d_mm", 3, is.length_m[4]);
  for (std::size_t i = 0; i < 2; ++i) {
    if (!data.hand[i]) continue;
    hold(i == 0 ? "$DH_4 DHART_A" : "$DH_5 DHART_A", data.hand[i]->a_mm / kMmPerM, "a_mm", 3 + i,
         0.0);
    hold(i == 0 ? "$DH_4 DHART_D" : "$DH_5 DHART_D", data.hand[i]->d_mm / kMmPerM, "d_mm", 3 + i,
         0.0);
  }
  hold("$TFLWP X", of(data.flange, 0), "flange", 5, 0.0);
  hold("$TFLWP Y", of(data.flange, 1), "flange", 5, 0.0);
  hold("$TFLWP Z", of(data.flange, 2), "d_mm", 5, is.length_m[5]);
  if (is.off_m > kSame) found = {{"", "A6", "flange", 0.0, is.off_m}};
  return found;
}

std::optional<ZeroComparison> controllers_zeros(const MachineData& data, const Robot& robot) {
  constexpr double kOtherLengthsM = 0.05;
  const Robot arm = behind_unit(robot);
  if (arm.joints.size() != 6) return std::nullopt;
  const ArmLengths is = lengths_of(arm, data);
  // Only the flange of such lengths may be turned, none of them to the other side.
  const bool counted_alike = is.off_m <= kSame && is.length_m[2] > 0.0 && is.length_m[4] > 0.0;
  const bool whole = data.base && data.length_a_m && data.length_b_m && data.wrist && data.flange;
  if (!counted_alike && !whole) return std::nullopt;
  const Robot own = counted_alike ? of_lengths(data, is.length_m) : standard_arm(data);
  const auto zeros = compare_zeros(joint_frames({arm, {}}), joint_frames({own, {}}));
  return zeros && zeros->aside_m < kOtherLengthsM ? zeros : std::nullopt;
}

std::optional<Eigen::Vector3d> gravity_of(const MachineData& data) {
  const ExternalAxes& external = data.external;
  if (!data.robroot && !external.ersys_root && external.of_kind("#ERSYS") == nullptr)
    return std::nullopt;
  return foot_in_world(external, data.robroot).linear().transpose() * Robot{}.gravity_m_s2;
}

Robot with_machine_data(Robot robot, const MachineData& data) {
  robot.gravity_m_s2 = gravity_of(data).value_or(robot.gravity_m_s2);
  const std::size_t first = robot.first_turning();
  for (std::size_t i = 0; i < std::min(robot.joints.size() - first, data.axes.size()); ++i) {
    const MachineAxis& axis = data.axes[i];
    Joint& joint = robot.joints[first + i];
    joint.min_rad = axis.min_rad.value_or(joint.min_rad);
    joint.max_rad = axis.max_rad.value_or(joint.max_rad);
    joint.max_speed_rad_s = axis.max_speed_rad_s.value_or(joint.max_speed_rad_s);
  }
  // A file that holds the controller's model stays so.
  const bool in_file = robot.absolute_accuracy == AbsoluteAccuracy::kInFile;
  if (data.absolute_accuracy() != AbsoluteAccuracy::kNotStated && !in_file)
    robot.absolute_accuracy = data.absolute_accuracy();
  return robot;
}

void set_usual_tolerances(Robot& robot) {
  constexpr double kPerM = 0.5e-3, kLeastM = 0.2e-3, kDigitM = 1e-5;
  double reach_m = 0.0;  // without the base's height and the flange's distance
  for (std::size_t i = robot.first_turning(); i < robot.joints.size(); ++i) {
    const bool end = i == robot.first_turning() || i + 1 == robot.joints.size();
    reach_m += std::hypot(robot.joints[i].a_m, end ? 0.0 : robot.joints[i].d_m);
  }
  for (std::size_t i = robot.first_turning(); i < robot.joints.size(); ++i) {
    robot.joints[i].tolerance_length_m =
        std::max(std::round(kPerM * reach_m / kDigitM) * kDigitM, kLeastM);
    robot.joints[i].tolerance_angle_rad = 0.035 * kRadPerDeg;
  }
}

Robot arm_of_controller(const MachineData& data) {
  Robot robot = with_machine_data(robot_of(data), data);
  set_usual_tolerances(robot);
  return robot;
}

}  // namespace cellcal::calib
