#pragma once
// Carriers of arm and bases: a calibration's linear unit and positioner in the controller's machine data.
//
// The controller places the arm's foot at ERSYSROOT TA1KR z(E1) TFLA3 ROBROOT in the world ($EX_KIN with #ERSYS), and
// the flange of a positioner at ROOT TA1KR Rz(E) [TA2A1 Rz(E)] TFLA3 (MACHINE_DEF[n]). The base frame of the calibration
// is the foot with the unit at 0.

#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "calib/result/calibration.h"
#include "daemon/krl/krl_program.h"

namespace cellcal::daemon::krl {

/// "E1" to "E6".
std::string name_of_axis(int axis);
/// Number of the linear unit's axis; 0: none.
int unit_axis(const calib::Robot& robot);
/// Axes of the arm, a linear unit aside.
inline std::size_t turning_axes(const calib::Robot& robot) {
  return robot.joints.size() - robot.first_turning();
}

/// Flange of a positioner in the robot's base at a point's angles.
struct CarriedFlange {
  Eigen::Isometry3d nominal;  ///< by the controller's data
  Eigen::Isometry3d real;     ///< as calibrated
  Eigen::Isometry3d mount;    ///< in the frame that the calibrated axes carry
  std::vector<double> carrier_rad;
};

class Carriers {
 public:
  /// A MACHINE_DEF whose kinematic is the calibration's positioner.
  struct Mounted {
    const calib::MachineKinematic* kinematic = nullptr;
    Eigen::Isometry3d root, mount;  ///< root in the robot's base
    bool as_found = false;          ///< by the calibrated axes; otherwise by those of the drawing
  };

  /// Keeps references to both.
  Carriers(const calib::Calibration& calibration, const Data& data);

  /// As krl::wrong_value, with the axes that the calibration has; a linear unit's position has to be stated, and
  /// the machine data must not contradict the unit.
  std::optional<Why> wrong_value(const Point& point) const;
  /// Position of a linear unit, if there is one, followed by A1 to A6.
  calib::JointVector axes_of(const Point& point) const;
  /// Angles with the linear unit, if there is one, where the point has it.
  calib::JointVector at_the_unit(calib::JointVector joints, const Point& point) const;
  /// [m]; 0 without a unit.
  double unit_m(const Point& point) const;
  /// With a linear unit at 0.
  Eigen::Isometry3d foot_in_world() const;
  /// Frame in the world in which $ROBROOT is, with a linear unit at 0.
  Eigen::Isometry3d rail_in_world() const;
  /// The machine data, where they are given, do not contradict the linear unit, or there is none.
  bool unit_fits() const { return unit_fits_; }
  /// By the index of MACHINE_DEF.
  const std::map<int, Mounted>& mounted() const { return mounted_; }

  /// MACHINE_DEF that carries the base; 0: none, -1: unknown.
  int machine_of(const FrameRef& base) const;
  std::variant<CarriedFlange, Why> flange(int machine, const Point& point) const;
  /// Within the angles that something on the positioner was touched at, where they are stated.
  bool touched(const CarriedFlange& flange) const;

 private:
  bool fits_the_unit() const;
  std::optional<Mounted> mounting(const calib::MachineDef& machine) const;

  const calib::Calibration& calibration_;
  const Data& data_;
  int unit_ = 0;                  ///< number of its axis; 0: none
  std::size_t touched_axes_ = 0;  ///< of the positioner, that carry something touched
  bool unit_fits_ = true;
  std::set<int> understood_;
  std::map<int, Mounted> mounted_;  ///< by MACHINE_DEF
};

}  // namespace cellcal::daemon::krl
