#pragma once
// A positioner: one or two rotary axes that turn the workpiece. Plain data.
//
// With the errors put into the exact chain (calib/model/README.md, (1c)), the frame that axes 1 ... n
// carry lies in the arm's base frame at
//   Pt = Pt_1 ... Pt_n
//   Pt_j = F_j Tx(ax_j) Ty(ay_j) Rx(arx_j + bx_j M_jx) Ry(ary_j + by_j M_jy) Rz(sgn_j e_j (1 + as_j) + k_j M_jz)
// with e_j the controller's axis angle and M_j the moment of gravity of what the axis carries. The arm is
// seen from there: its base stands at Pt^-1.

#include <Eigen/Geometry>
#include <string>

namespace cellcal::calib {

struct PositionerAxis {
  std::string name;
  /// F_j: in the frame that the axis before it carries, of the first in the base frame. The axis is
  /// its z.
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  int sign = 1;
  double min_rad = 0.0, max_rad = 0.0;
  double max_speed_rad_s = 0.0;  ///< 0: not stated
  // Prior 1 sigma; 0: known to be exact.
  double place_sigma_m = 0.0;        ///< of the axis across itself, x and y
  double direction_sigma_rad = 0.0;  ///< rx and ry
  double scale_sigma = 0.0;          ///< of its angle, rad per rad
  /// Of all that turns with it and not with the next axis, whose housing and drive are in it.
  double mass_kg = 0.0;
  Eigen::Vector3d com_m = Eigen::Vector3d::Zero();  ///< in the frame that it carries
  double compliance_sigma_rad_per_nm = 0.0;         ///< prior of k_j; acts with a mass only
  double bearing_sigma_rad_per_nm = 0.0;            ///< of bx_j, by_j, likewise
};

/// Maximum number of axes.
constexpr int kMaxPositionerAxes = 2;

/// Errors of a positioner's axis.
enum class AxisError { kX, kY, kTurnX, kTurnY, kScale, kCompliance, kBearingX, kBearingY };
constexpr int kAxisErrors = 8;

}  // namespace cellcal::calib
