#include "calib/export/machine_external.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/estimate/external_axes.h"
#include "calib/export/rigid_arm.h"
#include "calib/files/robot_file.h"
#include "calib/model/error.h"

namespace cellcal::calib {

namespace {

using Eigen::Isometry3d;
using krl::Stated;

constexpr int kMostAxes = 6, kArmAxes = 6, kMostType = 9;
constexpr double kFarthestMm = 1e5, kWidestDeg = 1e5;
constexpr std::array<const char*, 3> kBefore = {"TA1KR", "TA2A1", "TA3A2"};

Stated stated(bool readable) { return readable ? Stated::kValue : Stated::kUnreadable; }

template <class T>
Stated put(std::optional<T>& into, std::optional<T> value) {
  into = std::move(value);
  return stated(into.has_value());
}

std::optional<double> bounded_number(const krl::Line& line, const krl::Given& given,
                                     double largest) {
  const auto number = krl::read_number(line.tokens, given.value);
  return number && std::abs(*number) <= largest ? number : std::nullopt;
}

std::optional<int> small_whole(const krl::Line& line, const krl::Given& given, int most) {
  const auto number = bounded_number(line, given, most);
  const bool usable = number && *number >= 0.0 && *number == std::floor(*number);
  return usable ? std::optional(static_cast<int>(*number)) : std::nullopt;
}

std::optional<FrameMmDeg> bounded_frame(const std::optional<krl::Aggregate>& value) {
  auto frame = value ? krl::frame_of(*value) : std::nullopt;
  const auto within = [](const auto& numbers, double largest) {
    return std::ranges::all_of(numbers, [&](double one) { return std::abs(one) <= largest; });
  };
  if (frame && !(within(frame->xyz_mm, kFarthestMm) && within(frame->abc_deg, kWidestDeg)))
    frame.reset();
  return frame;
}

/// $SOFTN_END[7], $SOFTP_END[7], $AXIS_TYPE[7], $AXIS_DIR[7], ...
Stated read_drive(const krl::Line& line, const krl::Given& given, ExternalAxes& external) {
  const int axis = given.index - kArmAxes;
  if (axis < 1 || axis > kMostAxes) return Stated::kNothing;
  MachineDrive& drive = external.drives[static_cast<std::size_t>(axis - 1)];
  if (given.name == "$SOFTN_END") return put(drive.low, bounded_number(line, given, kWidestDeg));
  if (given.name == "$SOFTP_END") return put(drive.high, bounded_number(line, given, kWidestDeg));
  if (given.name == "$AXIS_TYPE") return put(drive.type, small_whole(line, given, kMostType));
  if (given.name != "$AXIS_DIR") return Stated::kNothing;
  const auto sense = bounded_number(line, given, 1.0);
  drive.sense = sense && *sense < 0.0 ? -1 : 1;
  return stated(sense.has_value());
}

/// $EX_KIN={ET1 #ERSYS,ET2 #NONE}
Stated read_kinds(const std::optional<krl::Aggregate>& value, ExternalAxes& external) {
  external.carry_arm.reset();
  for (auto& [name, kinematic] : external.kinematics) kinematic.kind.clear();
  if (!value) return Stated::kUnreadable;
  external.carry_arm =
      std::ranges::any_of(value->words, [](const auto& word) { return word.second == "#ERSYS"; });
  for (const auto& [name, kind] : value->words)
    if (kind != "#NONE") external.kinematics[name].kind = kind;
  return Stated::kValue;
}

/// $ETn_AX={TR_A1 #E1,TR_A2 #NONE}: axes up to the first gap.
std::vector<int> axes_of(const krl::Aggregate& value) {
  std::vector<int> axes;
  for (const char* place : {"TR_A1", "TR_A2", "TR_A3"}) {
    const auto at = value.words.find(place);
    if (at == value.words.end() || at->second.size() < 2) break;
    const int axis = external_axis(at->second.substr(1));
    if (axis == 0) break;
    axes.push_back(axis);
  }
  return axes;
}

/// $ET1_AX, $ET1_TFLA3, ...
Stated read_kinematic(const krl::Line& line, const krl::Given& given, ExternalAxes& external) {
  const std::string& name = given.name;
  if (name.size() < 6 || !name.starts_with("$ET") || name[3] < '1' || name[3] > '6' ||
      name[4] != '_')
    return Stated::kNothing;
  const std::string part = name.substr(5);
  const bool frame = part == "TFLA3" || std::ranges::find(kBefore, part) != kBefore.end();
  if (part != "AX" && !frame) return Stated::kNothing;
  MachineKinematic& kinematic = external.kinematics[name.substr(1, 3)];
  const auto value = krl::read_aggregate(line.tokens, given.value);
  if (part == "AX") {
    kinematic.axes = value ? axes_of(*value) : std::vector<int>();
    return stated(value.has_value());
  }
  const auto read = bounded_frame(value);
  if (read)
    kinematic.frames[part] = *read;
  else
    kinematic.frames.erase(part);
  return stated(read.has_value());
}

/// MACHINE_DEF[2]={NAME[] "DKP",...,ROOT {X ...},MECH_TYPE #EASYS,...}
void read_machine(const std::optional<krl::Aggregate>& value, int index, ExternalAxes& external) {
  external.machines.erase(index);
  if (!value) return;
  krl::Aggregate root;
  for (const auto& [member, number] : value->numbers)
    if (member.starts_with("ROOT.")) root.numbers.emplace(member.substr(5), number);
  const auto frame = bounded_frame(root);
  const auto kind = value->words.find("MECH_TYPE");
  if (frame && kind != value->words.end()) external.machines[index] = {*frame, kind->second};
}

/// MACHINE_FRAME_DAT[3]={MACH_DEF_INDEX 2,...}
void read_carried_base(const std::optional<krl::Aggregate>& value, int index,
                       ExternalAxes& external) {
  if (!value) {
    external.carried_bases[index] = -1;
    return;
  }
  const auto machine = value->numbers.find("MACH_DEF_INDEX");
  if (machine != value->numbers.end() && machine->second.value > 0.0)
    external.carried_bases[index] = krl::slot_number(machine->second.value).value_or(-1);
}

}  // namespace

int external_axis(const std::string& name) {
  const bool is = name.size() == 2 && name[0] == 'E' && name[1] >= '1' && name[1] <= '6';
  return is ? name[1] - '0' : 0;
}

std::optional<Isometry3d> flange_of(const MachineKinematic& kinematic,
                                    std::span<const double> turned_rad) {
  if (turned_rad.size() > kBefore.size()) return std::nullopt;
  Isometry3d at = Isometry3d::Identity();
  for (std::size_t j = 0; j < turned_rad.size(); ++j) {
    const auto before = kinematic.frames.find(kBefore[j]);
    if (before == kinematic.frames.end()) return std::nullopt;
    at = at * to_isometry(before->second) *
         Eigen::AngleAxisd(turned_rad[j], Eigen::Vector3d::UnitZ());
  }
  const auto last = kinematic.frames.find("TFLA3");
  if (last == kinematic.frames.end()) return std::nullopt;
  return at * to_isometry(last->second);
}

const MachineKinematic* ExternalAxes::of_kind(const std::string& kind) const {
  const MachineKinematic* found = nullptr;
  for (const auto& [name, kinematic] : kinematics) {
    if (kinematic.kind != kind) continue;
    if (found != nullptr) return nullptr;
    found = &kinematic;
  }
  return found;
}

Stated read_external_axes(const krl::Line& line, ExternalAxes& external) {
  const auto given = krl::read_given(line);
  if (!given) return Stated::kNothing;
  const auto value = [&] { return krl::read_aggregate(line.tokens, given->value); };
  const std::string& name = given->name;
  if (name == "$EX_AX_NUM") return put(external.count, small_whole(line, *given, kMostAxes));
  if (name == "$EX_KIN") return read_kinds(value(), external);
  if (name == "$ERSYSROOT" || name == "$ASR_ERSYSROOT")
    return put(external.ersys_root, bounded_frame(value()));
  const bool base = name == "MACHINE_FRAME_DAT";
  if (base || name == "MACHINE_DEF") {
    (base ? read_carried_base : read_machine)(value(), given->index, external);
    return Stated::kValue;
  }
  const Stated kinematic = read_kinematic(line, *given, external);
  return kinematic != Stated::kNothing ? kinematic : read_drive(line, *given, external);
}

Isometry3d foot_in_world(const ExternalAxes& external, const std::optional<FrameMmDeg>& robroot) {
  const Isometry3d mounted = to_isometry(robroot.value_or(FrameMmDeg{}));
  const MachineKinematic* const kinematic = external.of_kind("#ERSYS");
  const auto flange =
      kinematic == nullptr ? std::nullopt : flange_of(*kinematic, std::vector<double>{0.0});
  if (!flange) return mounted;
  return to_isometry(external.ersys_root.value_or(FrameMmDeg{})) * *flange * mounted;
}

// Parts of a robot file.

namespace {

constexpr double kShortestMm = 50.0, kNarrowestDeg = 1.0;
constexpr int kLinearType = 1;  // $AXIS_TYPE

[[noreturn]] void fail(const std::string& text) { throw FileError(text); }

const MachineDrive& drive_of(const ExternalAxes& external, int axis) {
  return external.drives[static_cast<std::size_t>(axis - 1)];
}

/// Names of the kinematics that `is` holds of.
template <class Is>
std::vector<std::string> kinematics_where(const ExternalAxes& external, Is is) {
  std::vector<std::string> found;
  for (const auto& [name, kinematic] : external.kinematics)
    if (!kinematic.kind.empty() && is(kinematic)) found.push_back(name);
  return found;
}

const FrameMmDeg& stated_frame(const MachineKinematic& of, const std::string& which,
                               const char* part) {
  const auto at = of.frames.find(part);
  if (at == of.frames.end())
    fail(fmt::format("${}_{}: not in the given machine data", which, part));
  return at->second;
}

void refuse_missing(const ExternalAxes& external, int axis) {
  if (external.count && *external.count < axis)
    fail(fmt::format("$EX_AX_NUM is {}, and $EX_KIN has a kinematic with E{}", *external.count,
                     axis));
  if (!drive_of(external, axis).type)
    fail(fmt::format("$AXIS_TYPE[{}]: not in the given machine data", axis + kArmAxes));
}

/// $SOFTN_END and $SOFTP_END, mm or degrees.
std::pair<double, double> range_of(const ExternalAxes& external, int axis, double narrowest,
                                   const char* unit) {
  const MachineDrive& drive = drive_of(external, axis);
  const int number = axis + kArmAxes;
  if (!drive.low || !drive.high)
    fail(fmt::format("$SOFTN_END[{0}], $SOFTP_END[{0}]: not both in the given machine data",
                     number));
  if (!(*drive.high - *drive.low >= narrowest))
    fail(fmt::format(
        "$SOFTN_END[{0}] = {1:g}, $SOFTP_END[{0}] = {2:g}: not a range of {3:g} {4} or more",
        number, *drive.low, *drive.high, narrowest, unit));
  return {*drive.low, *drive.high};
}

/// Root of the kinematic in the world, by the MACHINE_DEF of its kind.
Isometry3d root_of(const ExternalAxes& external, const std::string& kind) {
  const FrameMmDeg* root = nullptr;
  for (const auto& [index, machine] : external.machines) {
    if (machine.kind != kind) continue;
    if (root != nullptr && !to_isometry(*root).isApprox(to_isometry(machine.root)))
      fail(fmt::format("MACHINE_DEF: several of MECH_TYPE {} with different ROOT", kind));
    root = &machine.root;
  }
  if (root == nullptr)
    fail(fmt::format("MACHINE_DEF with MECH_TYPE {}: not in the given files. Give $config.dat, too",
                     kind));
  return to_isometry(*root);
}

/// As in the files, without digits of the computation.
double rounded(double value) {
  const double near = std::round(value * 1e9) / 1e9;
  return near == 0.0 ? 0.0 : near;
}

PositionerAxis axis_of(const ExternalAxes& external, int axis) {
  refuse_missing(external, axis);
  if (*drive_of(external, axis).type == kLinearType)
    fail(fmt::format("$AXIS_TYPE[{}] is 1: E{} slides, and a positioner's axes turn",
                     axis + kArmAxes, axis));
  const auto [low, high] = range_of(external, axis, kNarrowestDeg, "deg");
  PositionerAxis found = usual_positioner_axis();
  found.name = fmt::format("E{}", axis);
  found.min_rad = low * kRadPerDeg;
  found.max_rad = high * kRadPerDeg;
  return found;
}

}  // namespace

std::optional<Joint> linear_unit_of(const ExternalAxes& external,
                                    const std::optional<FrameMmDeg>& robroot) {
  const auto names =
      kinematics_where(external, [](const MachineKinematic& of) { return of.kind == "#ERSYS"; });
  if (names.empty()) return std::nullopt;
  if (names.size() > 1)
    fail(fmt::format("$EX_KIN: {} and {} both carry the arm (#ERSYS)", names[0], names[1]));
  const MachineKinematic& of = external.kinematics.at(names[0]);
  if (of.axes.empty()) fail(fmt::format("${}_AX: not in the given machine data", names[0]));
  if (of.axes[0] != 1)
    fail(fmt::format("${}_AX: TR_A1 is #E{}, and a linear unit is E1", names[0], of.axes[0]));
  if (of.axes.size() > 1)
    fail(fmt::format("${}_AX: TR_A2 is #E{}: more than one axis carries the arm", names[0],
                     of.axes[1]));
  refuse_missing(external, 1);
  const MachineDrive& drive = drive_of(external, 1);
  if (*drive.type != kLinearType)
    fail(fmt::format("$AXIS_TYPE[7] is {}: E1 turns, and a linear unit is of type 1", *drive.type));
  Eigen::Matrix3d foot = to_isometry(stated_frame(of, names[0], "TFLA3")).linear();
  if (robroot) foot *= to_isometry(*robroot).linear();
  Joint joint;
  joint.name = "E1";
  joint.guide = usual_guide();
  joint.guide->along = foot.transpose() * Eigen::Vector3d(0.0, 0.0, drive.sense);
  for (double& component : joint.guide->along) component = rounded(component);
  const auto [low, high] = range_of(external, 1, kShortestMm, "mm");
  joint.min_rad = low / kMmPerM;
  joint.max_rad = high / kMmPerM;
  return joint;
}

std::vector<PositionerAxis> positioner_of(const ExternalAxes& external,
                                          const std::optional<FrameMmDeg>& robroot) {
  if (external.count == 0) return {};
  const auto names = kinematics_where(
      external, [](const MachineKinematic& of) { return of.kind != "#ERSYS" && !of.axes.empty(); });
  if (names.empty()) return {};
  if (names.size() > 1)
    fail(fmt::format("$EX_KIN: {} and {} both carry work, and a robot file has one positioner",
                     names[0], names[1]));
  const MachineKinematic& of = external.kinematics.at(names[0]);
  if (of.axes.size() > kMaxPositionerAxes)
    fail(fmt::format("${}_AX: {} axes, and a positioner has at most {}", names[0], of.axes.size(),
                     kMaxPositionerAxes));
  std::vector<PositionerAxis> axes;
  Isometry3d before = foot_in_world(external, robroot).inverse() * root_of(external, of.kind);
  for (std::size_t j = 0; j < of.axes.size(); ++j) {
    axes.push_back(axis_of(external, of.axes[j]));
    axes.back().frame = before * to_isometry(stated_frame(of, names[0], kBefore[j]));
    before = Isometry3d::Identity();
  }
  return axes;
}

namespace {

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
    text +=
        fmt::format(" and {:.3f} mrad that it gives at most under its load", give * kMradPerRad);
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
  const Isometry3d foot(Eigen::Quaterniond::FromTwoVectors(found.guide->along, drawn.guide->along));
  const OmittedEffects rest = left_out_of_unit(c, true), all = left_out_of_unit(c, false);
  return fmt::format(
      "; linear unit {0} as calibrated: direction of travel +- {1:.3f} mrad (95 %). The arm's foot on the carriage\n"
      "; turns by the frame below: $ETn_TFLA3=$ETn_TFLA3:$ROBROOT:(frame):INV_POS($ROBROOT), ETn its kinematic in\n"
      "; $EX_KIN with #ERSYS. Angles and {0} count as before; measure bases anew.\n"
      "; scale {2:+.4f} mm/m +- {3:.4f}, straightness, roll, pitch and yaw are not in machine data. As drawn the unit\n"
      "; costs {4:.3f} mm in the mean, {5:.3f} mm at most over the workspace; with the turn {6:.3f} and {7:.3f} mm.\n"
      "; (frame)={8}\n",
      found.name, line.direction_u95_rad * kMmPerM, line.scale * kMmPerM, line.scale_u95 * kMmPerM,
      all.mean_m * kMmPerM, all.max_m * kMmPerM, rest.mean_m * kMmPerM, rest.max_m * kMmPerM,
      krl_frame(foot));
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
  return (unit ? unit_lines(c) : std::string()) +
         (positioner ? positioner_lines_of(c) : std::string());
}

}  // namespace cellcal::calib
