#include "daemon/krl/external_axes.h"

#include <algorithm>
#include <cmath>

#include "calib/export/krl_values.h"

namespace cellcal::daemon::krl {

namespace {

using calib::krl::Aggregate;
using calib::krl::Given;
using calib::krl::Line;
using Eigen::Isometry3d;

constexpr int kMostAxes = 6;
constexpr std::array<const char*, 3> kBefore = {"TA1KR", "TA2A1", "TA3A2"};

std::optional<int> small_whole(const Line& line, const Given& given) {
  const auto number = calib::krl::read_number(line.tokens, given.value);
  const bool usable =
      number && *number >= 0.0 && *number <= kMostAxes && *number == std::floor(*number);
  return usable ? std::optional(static_cast<int>(*number)) : std::nullopt;
}

/// $EX_KIN={ET1 #ERSYS,ET2 #NONE}
void read_kinds(const std::optional<Aggregate>& value, ExternalAxes& external) {
  external.carry_arm.reset();
  for (auto& [name, kinematic] : external.kinematics) kinematic.kind.clear();
  if (!value) return;
  external.carry_arm =
      std::ranges::any_of(value->words, [](const auto& word) { return word.second == "#ERSYS"; });
  for (const auto& [name, kind] : value->words)
    if (kind != "#NONE") external.kinematics[name].kind = kind;
}

/// $ETn_AX={TR_A1 #E1,TR_A2 #NONE}: axes up to the first gap.
std::vector<int> axes_of(const std::optional<Aggregate>& value) {
  std::vector<int> axes;
  for (const char* place : {"TR_A1", "TR_A2", "TR_A3"}) {
    const auto at = value ? value->words.find(place) : decltype(value->words.end()){};
    if (!value || at == value->words.end() || at->second.size() < 2) break;
    const int axis = external_axis(at->second.substr(1));
    if (axis == 0) break;
    axes.push_back(axis);
  }
  return axes;
}

/// $ET1_AX, $ET1_TFLA3, ...
bool read_kinematic(const Line& line, const Given& given, ExternalAxes& external) {
  const std::string& name = given.name;
  if (name.size() < 6 || !name.starts_with("$ET") || name[3] < '1' || name[3] > '6' ||
      name[4] != '_')
    return false;
  const std::string part = name.substr(5);
  const bool frame = part == "TFLA3" || std::ranges::find(kBefore, part) != kBefore.end();
  if (part != "AX" && !frame) return false;
  Kinematic& kinematic = external.kinematics[name.substr(1, 3)];
  const auto value = calib::krl::read_aggregate(line.tokens, given.value);
  if (part == "AX") {
    kinematic.axes = axes_of(value);
    return true;
  }
  const auto read = value ? calib::krl::frame_of(*value) : std::nullopt;
  if (read)
    kinematic.frames[part] = *read;
  else
    kinematic.frames.erase(part);
  return true;
}

/// MACHINE_DEF[2]={NAME[] "DKP",...,ROOT {X ...},MECH_TYPE #EASYS,...}
void read_machine(const std::optional<Aggregate>& value, int index, ExternalAxes& external) {
  external.machines.erase(index);
  if (!value) return;
  Aggregate root;
  for (const auto& [member, number] : value->numbers)
    if (member.starts_with("ROOT.")) root.numbers.emplace(member.substr(5), number);
  const auto frame = calib::krl::frame_of(root);
  const auto kind = value->words.find("MECH_TYPE");
  if (frame && kind != value->words.end()) external.machines[index] = {*frame, kind->second};
}

}  // namespace

int external_axis(const std::string& name) {
  const bool is = name.size() == 2 && name[0] == 'E' && name[1] >= '1' && name[1] <= '6';
  return is ? name[1] - '0' : 0;
}

std::optional<Isometry3d> flange_of(const Kinematic& kinematic,
                                    std::span<const double> turned_rad) {
  if (turned_rad.size() > kBefore.size()) return std::nullopt;
  Isometry3d at = Isometry3d::Identity();
  for (std::size_t j = 0; j < turned_rad.size(); ++j) {
    const auto before = kinematic.frames.find(kBefore[j]);
    if (before == kinematic.frames.end()) return std::nullopt;
    at = at * calib::to_isometry(before->second) *
         Eigen::AngleAxisd(turned_rad[j], Eigen::Vector3d::UnitZ());
  }
  const auto last = kinematic.frames.find("TFLA3");
  if (last == kinematic.frames.end()) return std::nullopt;
  return at * calib::to_isometry(last->second);
}

const Kinematic* ExternalAxes::of_kind(const std::string& kind) const {
  const Kinematic* found = nullptr;
  for (const auto& [name, kinematic] : kinematics) {
    if (kinematic.kind != kind) continue;
    if (found != nullptr) return nullptr;
    found = &kinematic;
  }
  return found;
}

bool read_external_axes(const Line& line, ExternalAxes& external) {
  const auto given = calib::krl::read_given(line);
  if (!given) return false;
  if (given->name == "$EX_AX_NUM") {
    external.count = small_whole(line, *given);
    return true;
  }
  if (given->name == "$AXIS_DIR" && given->index == 7) {
    const auto number = calib::krl::read_number(line.tokens, given->value);
    external.sense = number && *number < 0.0 ? -1 : 1;
    return true;
  }
  if (read_kinematic(line, *given, external)) return true;
  const bool kinds = given->name == "$EX_KIN", root = given->name == "$ERSYSROOT" ||
                                                       given->name == "$ASR_ERSYSROOT";
  const bool base = given->name == "MACHINE_FRAME_DAT", machine = given->name == "MACHINE_DEF";
  if (!kinds && !root && !base && !machine) return false;
  const auto value = calib::krl::read_aggregate(line.tokens, given->value);
  if (kinds) read_kinds(value, external);
  if (root) external.ersys_root = value ? calib::krl::frame_of(*value) : std::nullopt;
  if (machine) read_machine(value, given->index, external);
  if (!base) return true;
  const auto index =
      value ? value->numbers.find("MACH_DEF_INDEX") : decltype(value->numbers.end()){};
  if (!value)
    external.carried_bases[given->index] = -1;
  else if (index != value->numbers.end() && index->second.value > 0.0)
    external.carried_bases[given->index] =
        calib::krl::slot_number(index->second.value).value_or(-1);
  return true;
}

}  // namespace cellcal::daemon::krl
