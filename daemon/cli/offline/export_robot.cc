#include <fmt/format.h>

#include <cstdio>

#include "calib/export/tables.h"
#include "calib/export/urdf.h"
#include "calib/files/input_file.h"
#include "calib/model/units.h"
#include "daemon/cli/offline/exit_status.h"
#include "daemon/cli/offline/offline.h"

namespace cellcal::daemon {

namespace {

std::string rigid_words(const calib::LeftOut& out) {
  return fmt::format(
      "{:.3f} mm mean, {:.3f} mm max over the workspace: effect of compliance, gears and bending, "
      "which rigid links cannot hold",
      out.mean_m * calib::kMmPerM, out.max_m * calib::kMmPerM);
}

std::string comment(const ExportRobotCommand& command, const calib::Calibration& calibration,
                    const calib::LeftOut& out) {
  return fmt::format("calibrated {}, from {}\n{}", calibration.cell.robot.name,
                     command.calibration.filename().string(), rigid_words(out));
}

}  // namespace

int export_robot(const ExportRobotCommand& command) {
  const auto usable = usable_calibration("export-robot", command.calibration, command.withheld);
  if (!usable) return kNotPublishable;
  const calib::Calibration& calibration = *usable;
  if (command.as == "json") {
    put(calib::arm_json(calibration), command.output);
    return kSuccess;
  }
  const calib::RigidArm nominal = calib::nominal_rigid_arm(calibration.cell);
  const calib::RigidArm real = calib::calibrated_rigid_arm(calibration);
  if (command.as == "dh") {
    put(calib::dh_csv(nominal, real), command.output);
    return kSuccess;
  }
  const calib::LeftOut out = calib::left_out(calibration);
  const std::string words = comment(command, calibration, out);
  std::string text;
  if (command.urdf.empty()) {
    const calib::JointFrames frames = calib::joint_frames(real);
    text = command.as == "urdf" ? calib::urdf_of(frames, calibration.cell.robot.name, words)
                                : calib::ros_yaml(frames, words);
  } else {
    const std::string given = calib::read_file(command.urdf, calib::kMostUrdfBytes);
    const std::string name = command.urdf.string();
    text =
        command.as == "urdf"
            ? calib::calibrated_urdf(given, name, command.tip, nominal, real, words)
            : calib::ros_yaml(calib::moved_frames(calib::read_urdf(given, name, command.tip).frames,
                                                  nominal, real),
                              words);
  }
  put(text, command.output);
  fmt::print(stderr, "left out: {}. Where that is too much, correct poses: cellcal correct\n",
             rigid_words(out));
  return kSuccess;
}

}  // namespace cellcal::daemon
