// The linear unit that carries the arm, of machine data.

#include <fmt/format.h>

#include <cmath>

#include "calib/export/machine_data.h"
#include "calib/files/robot_file.h"
#include "calib/model/error.h"

namespace cellcal::calib {
namespace {

constexpr double kShortestMm = 50.0, kLongestMm = 1e5;
constexpr int kLinearType = 1;  // $AXIS_TYPE

/// "ET1" of the kinematic with #ERSYS; empty: none. Throws FileError for several.
std::string carrying_kinematic(const MachineData& data) {
  std::string found;
  for (const auto& [kinematic, kind] : data.external.kinds) {
    if (kind != "#ERSYS") continue;
    if (!found.empty())
      throw FileError(
          fmt::format("$EX_KIN: {} and {} both carry the arm (#ERSYS)", found, kinematic));
    found = kinematic;
  }
  return found;
}

const MachineKinematic& stated_kinematic(const MachineData& data, const std::string& which) {
  static const MachineKinematic none;
  const auto at = data.external.kinematics.find(which);
  return at == data.external.kinematics.end() ? none : at->second;
}

void refuse_other_axes(const MachineKinematic& of, const std::string& which) {
  const auto first = of.axes.find("TR_A1");
  if (first == of.axes.end())
    throw FileError(fmt::format("${}_AX: not in the given machine data", which));
  if (first->second != "#E1")
    throw FileError(
        fmt::format("${}_AX: TR_A1 is {}, and a linear unit is E1", which, first->second));
  for (const char* further : {"TR_A2", "TR_A3"})
    if (const auto at = of.axes.find(further); at != of.axes.end() && at->second != "#NONE")
      throw FileError(fmt::format("${}_AX: {} is {}: more than one axis carries the arm", which,
                                  further, at->second));
}

void refuse_other_types(const MachineExternal& external) {
  if (external.count && *external.count < 1)
    throw FileError("$EX_AX_NUM is 0, and $EX_KIN has a kinematic that carries the arm");
  if (!external.type) throw FileError("$AXIS_TYPE[7]: not in the given machine data");
  if (*external.type != kLinearType)
    throw FileError(fmt::format("$AXIS_TYPE[7] is {}: E1 turns, and a linear unit is of type 1",
                                *external.type));
}

/// Range [mm].
void set_range(const MachineExternal& external, Joint& joint) {
  if (!external.low || !external.high)
    throw FileError("$SOFTN_END[7], $SOFTP_END[7]: not both in the given machine data");
  if (!(*external.high - *external.low >= kShortestMm) || std::abs(*external.low) > kLongestMm ||
      std::abs(*external.high) > kLongestMm)
    throw FileError(
        fmt::format("$SOFTN_END[7] = {:g}, $SOFTP_END[7] = {:g}: not a range of 50 mm "
                    "or more",
                    *external.low, *external.high));
  joint.min_rad = *external.low / kMmPerM;
  joint.max_rad = *external.high / kMmPerM;
}

/// Carriage to the arm's foot: the frames after the axis, which moves along z.
Eigen::Matrix3d foot_in_carriage(const MachineKinematic& of, const std::string& which,
                                 const MachineData& data) {
  if (!of.frames.contains("TFLA3"))
    throw FileError(fmt::format("${}_TFLA3: not in the given machine data", which));
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  for (const char* part : {"TA2A1", "TA3A2", "TFLA3"})
    if (const auto at = of.frames.find(part); at != of.frames.end())
      turn *= to_isometry(at->second).linear();
  if (data.robroot) turn *= to_isometry(*data.robroot).linear();
  return turn;
}

}  // namespace

std::optional<Joint> linear_unit_of(const MachineData& data) {
  const std::string which = carrying_kinematic(data);
  if (which.empty()) return std::nullopt;
  const MachineKinematic& of = stated_kinematic(data, which);
  refuse_other_axes(of, which);
  refuse_other_types(data.external);
  Joint joint;
  joint.name = "E1";
  joint.guide = usual_guide();
  joint.guide->along = foot_in_carriage(of, which, data).transpose() *
                       Eigen::Vector3d(0.0, 0.0, data.external.sense);
  // Frames are stated in degrees: an axis of the foot shall be one.
  for (double& component : joint.guide->along) {
    component = std::round(component * 1e9) / 1e9;
    if (component == 0.0) component = 0.0;
  }
  set_range(data.external, joint);
  return joint;
}

Eigen::Matrix3d foot_in_world(const MachineData& data) {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  const std::string which = carrying_kinematic(data);
  const auto& frames = stated_kinematic(data, which).frames;
  const bool carried = !which.empty() && frames.contains("TFLA3") && frames.contains("TA1KR");
  if (carried && data.external.root) turn = to_isometry(*data.external.root).linear();
  if (carried)
    return turn * to_isometry(frames.at("TA1KR")).linear() *
           foot_in_carriage(stated_kinematic(data, which), which, data);
  return data.robroot ? Eigen::Matrix3d(to_isometry(*data.robroot).linear()) : turn;
}

}  // namespace cellcal::calib
