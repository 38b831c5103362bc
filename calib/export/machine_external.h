#pragma once
// Axes beyond the arm's six in $machine.dat and $config.dat, and what they carry: the arm's foot on a linear unit
// ($EX_KIN with #ERSYS), and work on a positioner (#EASYS to #EFSYS).
//
//   foot in the world    $ERSYSROOT $ETn_TA1KR z(E) $ETn_TFLA3 $ROBROOT
//   table in the world   MACHINE_DEF[n].ROOT $ETn_TA1KR Rz(E) [$ETn_TA2A1 Rz(E)] $ETn_TFLA3
//
// The order of the table's frames is that of two offline systems that read such files.

#include <Eigen/Geometry>
#include <array>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/export/krl_values.h"
#include "calib/model/robot.h"
#include "calib/model/units.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// $ETn: up to three axes in a chain. Each turns about z of its frame, or slides along it.
struct MachineKinematic {
  std::string kind;       ///< $EX_KIN: "#EASYS", "#ERSYS", ...; empty: not stated
  std::vector<int> axes;  ///< $ETn_AX: 1 of #E1; those before the first #NONE
  /// $ETn_TA1KR, $ETn_TA2A1, $ETn_TA3A2, $ETn_TFLA3 by their ending.
  std::map<std::string, FrameMmDeg> frames;
};
/// Its flange from its root, its axes at these positions [rad]; as many as it has. Empty: a frame is not stated.
std::optional<Eigen::Isometry3d> flange_of(const MachineKinematic& kinematic,
                                           std::span<const double> turned_rad);

/// MACHINE_DEF[n]: its root in the world, and the kinematic by its kind.
struct MachineDef {
  FrameMmDeg root;
  std::string kind;  ///< MECH_TYPE
};

/// E1 to E6 by [7] to [12]; mm or degrees.
struct MachineDrive {
  std::optional<double> low, high;  ///< $SOFTN_END, $SOFTP_END
  std::optional<int> type;          ///< $AXIS_TYPE
  int sense = 1;                    ///< $AXIS_DIR
};

struct ExternalAxes {
  std::optional<int> count;       ///< $EX_AX_NUM
  std::optional<bool> carry_arm;  ///< $EX_KIN has #ERSYS: a linear unit below the arm
  std::map<int, int>
      carried_bases;  ///< MACHINE_FRAME_DAT[n]: MACH_DEF_INDEX above 0; -1: unreadable
  std::map<std::string, MachineKinematic> kinematics;  ///< by "ET1"
  std::map<int, MachineDef> machines;                  ///< by the index of MACHINE_DEF
  std::optional<FrameMmDeg>
      ersys_root;  ///< $ERSYSROOT, $ASR_ERSYSROOT: of the kinematic with #ERSYS in the world
  std::array<MachineDrive, 6> drives;

  /// True if the arm's place is regardless of E1 to E6: that one is not there, or none carries it.
  bool leave_the_arm(int axis) const {
    return (count && axis > *count) || (carry_arm && !*carry_arm);
  }
  /// The only kinematic of that kind; null: none, or several.
  const MachineKinematic* of_kind(const std::string& kind) const;
};

/// Takes a line of the machine data or of $config.dat on external axes. An unreadable value invalidates the
/// earlier one, too.
krl::Stated read_external_axes(const krl::Line& line, ExternalAxes& external);

/// Names of external axes, "E1" to "E6": 1 to 6; else 0.
int external_axis(const std::string& name);

/// The arm's foot with a linear unit at 0; without one, or where its frames are not stated, $ROBROOT.
Eigen::Isometry3d foot_in_world(const ExternalAxes& external,
                                const std::optional<FrameMmDeg>& robroot);

/// The linear unit that carries the arm, with the usual priors and without a speed, which machine data state as
/// turns of a motor alone; empty: none. Its axis moves along z of $ETn_TA1KR. Throws FileError naming the variable
/// that is missing, or of another kinematic.
std::optional<Joint> linear_unit_of(const ExternalAxes& external,
                                    const std::optional<FrameMmDeg>& robroot);

/// The axes of the positioner, base outwards, with the usual priors, in the frame of the arm's foot; empty: none.
/// $ETn_TFLA3, the table's flange, is not part of them. Throws FileError as linear_unit_of().
std::vector<PositionerAxis> positioner_of(const ExternalAxes& external,
                                          const std::optional<FrameMmDeg>& robroot);

// A positioner as a KUKA controller's machine data state it: each axis turns about z of its frame in the
// controller's sense ($ETn_TA1KR, $ETn_TA2A1), and $ETn_TFLA3 leads to what the last one carries. KR C2
// machine data, "2 The file $MACHINE.DAT".

struct ExternalKinematic {
  std::vector<Eigen::Isometry3d>
      axes;  ///< of the first in the base frame, of the next in the one before
  Eigen::Isometry3d flange = Eigen::Isometry3d::Identity();
};
ExternalKinematic external_kinematic(const std::vector<PositionerAxis>& positioner);

/// Lines of $MACHINE.DAT for the axes as found, with their bounds, and instead of the first the root point
/// that lets $ETn_TA1KR stay as drawn; of a linear unit the turn of the arm's foot, and what machine data lack of it.
/// A comment states the use of each. ASCII, LF. Throws FileError for a robot without either.
std::string external_kinematic_lines(const Calibration& calibration);

}  // namespace cellcal::calib
