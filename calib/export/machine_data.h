#pragma once
// Arm data in a KUKA controller's machine data: $machine.dat and $robcor.dat (KRC:\R1\Mada),
// TOOL_DATA of $config.dat. KR C2 machine data, "2 The file $MACHINE.DAT".

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calib/model/robot.h"
#include "calib/model/units.h"

namespace cellcal::calib {

struct MachineAxis {
  std::optional<double> min_rad, max_rad;  ///< $SOFTN_END, $SOFTP_END
  std::optional<double> max_speed_rad_s;   ///< $VEL_AXIS_MA over $RAT_MOT_AX
};

struct MachineData {
  std::string type;  ///< $TRAFONAME[], $MODEL_NAME[]
  std::array<MachineAxis, 6> axes;
  std::optional<double> length_a_m, length_b_m;  ///< $LENGTH_A, $LENGTH_B
  std::optional<double> wrist_m;                 ///< $TX3P3: from axis 3 to the wrist's centre
  std::optional<double> flange_m;                ///< $TFLWP: wrist point to flange
  std::map<int, FrameMmDeg> tools;               ///< TOOL_DATA[n], nonzero entries
};

/// Merges the values stated in one file into `data`; other lines are ignored. Throws FileError
/// naming file, line and variable for an invalid value.
void read_machine_data(std::string_view text, const std::string& name, MachineData& data);

/// A length that differs between robot file and controller.
struct LengthDifference {
  std::string variable, joint, key;  ///< "$LENGTH_A", "A1", "a_mm"
  double controller_m = 0.0, robot_m = 0.0;
};
/// Differences above 0.01 mm. The robot is a six-axis arm with the axes of KUKA's standard
/// kinematics.
std::vector<LengthDifference> differences(const MachineData& data, const Robot& robot);

/// The robot with the controller's limits and speeds, if stated.
Robot with_machine_data(Robot robot, const MachineData& data);

}  // namespace cellcal::calib
