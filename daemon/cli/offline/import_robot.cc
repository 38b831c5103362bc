#include <fmt/format.h>

#include <cstdio>

#include "calib/export/machine_data.h"
#include "calib/export/rigid_arm.h"
#include "calib/export/tables.h"
#include "calib/export/urdf.h"
#include "calib/files/cell_file.h"
#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/model/units.h"
#include "daemon/cli/offline/exit_status.h"
#include "daemon/cli/offline/offline.h"

namespace cellcal::daemon {

namespace {

/// As most shipped robots state them.
constexpr double kUsualLengthM = 0.7e-3;
constexpr double kUsualAngleRad = 0.035 * calib::kRadPerDeg;

calib::Robot from_urdf(const ImportRobotCommand& command) {
  const std::string name = command.urdf.string();
  const calib::UrdfChain chain =
      calib::read_urdf(calib::read_file(command.urdf, calib::kMostUrdfBytes), name, command.tip);
  calib::Robot robot = calib::robot_of(chain.frames);
  robot.name = chain.robot_name.empty() ? "robot" : chain.robot_name;
  robot.source = command.urdf.filename().string();
  for (calib::Joint& joint : robot.joints) {
    joint.name = calib::robot_joint_name(joint.name);
    joint.tolerance_length_m = kUsualLengthM;
    joint.tolerance_angle_rad = kUsualAngleRad;
  }
  fmt::print(stderr,
             "chain \"{}\" to \"{}\", {} joints. Check joint senses and zeros against the "
             "pendant before use\n",
             chain.base_link, chain.tip_link, robot.joints.size());
  return robot;
}

void print_differences(const calib::MachineData& data, const calib::Robot& robot) {
  for (const calib::LengthDifference& one : calib::differences(data, robot))
    fmt::print(stderr,
               "warning: {} {:.3f} mm in the controller, {:.3f} mm in the robot file ({} of {}). "
               "Check the robot's type and choose its file\n",
               one.variable, one.controller_m * calib::kMmPerM, one.robot_m * calib::kMmPerM,
               one.key, one.joint);
}

void print_tools(const calib::MachineData& data) {
  for (const auto& [number, tool] : data.tools)
    fmt::print(
        stderr,
        "TOOL_DATA[{}], for [tool] of the cell file: xyz_mm = [{}, {}, {}], abc_deg = [{}, {}, {}]\n",
        number, tool.xyz_mm[0], tool.xyz_mm[1], tool.xyz_mm[2], tool.abc_deg[0], tool.abc_deg[1],
        tool.abc_deg[2]);
}

}  // namespace

int import_robot(const ImportRobotCommand& command) {
  calib::Robot robot =
      command.urdf.empty() ? calib::load_named_robot(command.robot.string()) : from_urdf(command);
  calib::MachineData data;
  for (const auto& file : command.machine_data)
    calib::read_machine_data(calib::read_file(file), file.string(), data);
  if (!command.machine_data.empty()) {
    print_differences(data, robot);
    robot = calib::with_machine_data(std::move(robot), data);
    if (!data.type.empty()) robot.source += (robot.source.empty() ? "" : "; ") + data.type;
    print_tools(data);
  }
  put(calib::robot_to_toml(robot), command.output);
  return kSuccess;
}

}  // namespace cellcal::daemon
