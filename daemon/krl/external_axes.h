#pragma once
// Axes beyond the arm's six, of $machine.dat and $config.dat, and what they carry.

#include <Eigen/Geometry>
#include <array>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/export/krl_text.h"
#include "calib/model/units.h"

namespace cellcal::daemon::krl {

/// $ETn: up to three axes in a chain. Each turns about z of its frame, or slides along it.
struct Kinematic {
  std::string kind;       ///< $EX_KIN: "#EASYS", "#ERSYS", ...; empty: not stated
  std::vector<int> axes;  ///< $ETn_AX: 1 of #E1; those before the first #NONE
  /// $ETn_TA1KR, $ETn_TA2A1, $ETn_TA3A2, $ETn_TFLA3 by their ending.
  std::map<std::string, calib::FrameMmDeg> frames;
};
/// Its flange from its root, its axes at these positions [rad]; as many as it has. Empty: a frame is not stated.
std::optional<Eigen::Isometry3d> flange_of(const Kinematic& kinematic,
                                           std::span<const double> turned_rad);

/// MACHINE_DEF[n]: its root in the world, and the kinematic by its kind.
struct MachineDef {
  calib::FrameMmDeg root;
  std::string kind;  ///< MECH_TYPE
};

struct ExternalAxes {
  std::optional<int> count;                     ///< $EX_AX_NUM
  std::optional<bool> carry_arm;                ///< $EX_KIN has #ERSYS: a linear unit below the arm
  std::map<int, int> carried_bases;             ///< MACHINE_FRAME_DAT[n]: MACH_DEF_INDEX above 0; -1: unreadable
  std::map<std::string, Kinematic> kinematics;  ///< by "ET1"
  std::map<int, MachineDef> machines;           ///< by the index of MACHINE_DEF
  std::optional<calib::FrameMmDeg> ersys_root;  ///< $ERSYSROOT: of the kinematic with #ERSYS in the world
  int sense = 1;                                ///< $AXIS_DIR[7]

  /// True if the arm's place is regardless of E1 to E6: that one is not there, or none carries it.
  bool leave_the_arm(int axis) const {
    return (count && axis > *count) || (carry_arm && !*carry_arm);
  }
  /// The only kinematic of that kind; null: none, or several.
  const Kinematic* of_kind(const std::string& kind) const;
};

/// A line of the machine data or of $config.dat on external axes; false: another statement.
bool read_external_axes(const calib::krl::Line& line, ExternalAxes& external);

/// Names of external axes, "E1" to "E6": 1 to 6; else 0.
int external_axis(const std::string& name);

}  // namespace cellcal::daemon::krl
