#pragma once
// Machine data of a KUKA controller on its arm: $machine.dat and $robcor.dat (KRC:\R1\Mada), and
// TOOL_DATA, BASE_DATA, LOAD_DATA of $config.dat. KR C2 machine data, "2 The file $MACHINE.DAT".

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calib/export/krl_values.h"
#include "calib/export/machine_external.h"
#include "calib/export/rigid_arm.h"
#include "calib/model/robot.h"
#include "calib/model/units.h"

namespace cellcal::calib {

struct MachineAxis {
  std::optional<double> min_rad, max_rad;  ///< $SOFTN_END, $SOFTP_END
  std::optional<double> max_speed_rad_s;   ///< $VEL_AXIS_MA over $RAT_MOT_AX
  std::optional<double> gear_ratio;        ///< $RAT_MOT_AX: motor turns for one of the axis
  std::optional<int> sense;                ///< $AXIS_DIR
  std::optional<double> mastering_rad;     ///< $MAMES: shown at the mark, unless marks_in_arm
};

/// $DH_4, $DH_5.
struct HandLink {
  double a_mm = 0.0, d_mm = 0.0, alpha_deg = 0.0;
};

struct MachineData : krl::ControllerFrames {
  /// $TRAFONAME[], whose geometry is in $machine.dat, and $MODEL_NAME[] of $robcor.dat.
  std::string trafo_name, model_name;
  const std::string& type() const { return trafo_name.empty() ? model_name : trafo_name; }
  std::array<MachineAxis, 6> axes;
  std::optional<double> length_a_m, length_b_m;  ///< $LENGTH_A, $LENGTH_B
  std::optional<FrameMmDeg> base;                ///< $TIRORO: foot to the height of axis 2
  std::optional<FrameMmDeg> wrist;               ///< $TX3P3: axis 3 to the wrist's centre
  std::optional<FrameMmDeg> flange;              ///< $TFLWP: wrist's centre to flange
  std::array<std::optional<HandLink>, 2> hand;
  /// $ABS_ACCUR: KRC2 TRUE or FALSE, later #ACTIVATED, #SUPPRESSED or #NONE; #ACTIVE, #INACTIVE.
  AbsoluteAccuracy stated_accuracy = AbsoluteAccuracy::kNotStated;
  bool accuracy_deactivated = false;  ///< $DEACTIVATE_ABS_ACCUR or $SUPPRESS_ABS_ACCUR is TRUE
  AbsoluteAccuracy absolute_accuracy() const {
    return stated_accuracy == AbsoluteAccuracy::kActive && accuracy_deactivated
               ? AbsoluteAccuracy::kOff
               : stated_accuracy;
  }
  /// $INDIVIDUAL_MAMES is not #NONE: angles at the marks are this arm's own, in the RDC on its foot, not $MAMES.
  bool marks_in_arm = false;
  std::map<int, std::string> tool_places;    ///< "$config.dat:120" of TOOL_DATA[n]
  std::map<std::string, std::string> kinds;  ///< $KINCLASS and the like, as stated
  /// "$machine.dat:420" of the variables without an index.
  std::map<std::string, std::string> places;
  ExternalAxes external;
};

/// Merges the values stated in one file into `data`; other lines are ignored. Throws FileError
/// naming file, line and variable for an invalid value, and for a frame or load stated before with another.
void read_machine_data(std::string_view text, const std::string& name, MachineData& data);

/// Likewise what it states on the arm and its accuracy alone, without tools, bases and external axes.
void read_arm(std::string_view text, const std::string& name, MachineData& data);

/// Likewise what they state on absolute accuracy alone, whatever else is in the file.
void read_absolute_accuracy(std::string_view text, const std::string& name, MachineData& data);

/// Warning of $TRAFONAME and $MODEL_NAME that name two robots, and where; empty: they agree, or one is not stated.
std::string two_robots(const MachineData& data);

/// The six-axis arm with a spherical wrist that they describe. Throws FileError naming the variable
/// that is missing, or, with its place, that belongs to another kind of arm.
Robot robot_of(const MachineData& data);

/// Those of the shipped industrial robots (calib/robots): lengths 0.5 mm per metre of reach, at least 0.2 mm.
void set_usual_tolerances(Robot& robot);
/// robot_of() with usual tolerances and the controller's limits and speeds: a robot file's content.
Robot arm_of_controller(const MachineData& data);

/// A length that differs between robot file and controller, with its sign.
struct LengthDifference {
  std::string variable, joint, key;  ///< "$LENGTH_A", "A1", "a_mm"
  double controller_m = 0.0, robot_m = 0.0;
};
/// Differences of more than 0.01 mm, regardless of the frames in which the robot file states its
/// arm, and of a linear unit below it. If the arm is not described by such lengths, or its axes turn the other way: one entry with
/// an empty variable, whose robot_m is the distance of the flanges.
std::vector<LengthDifference> differences(const MachineData& data, const Robot& robot);

/// How the controller's angles follow from the robot's, for the arm that a linear unit carries. Empty: the same arm cannot be seen in both, or the machine
/// data do not describe it as a whole.
std::optional<ZeroComparison> controllers_zeros(const MachineData& data, const Robot& robot);

/// Gravity at the arm's foot, by $ROBROOT and what carries it; empty: not stated.
std::optional<Eigen::Vector3d> gravity_of(const MachineData& data);

/// The robot with the controller's limits, speeds, gravity and absolute accuracy, if stated.
Robot with_machine_data(Robot robot, const MachineData& data);

}  // namespace cellcal::calib
