#pragma once
// A positioner: one or two rotary axes that turn the workpiece. Plain data.
//
// With the errors put into the exact chain (calib/model/README.md, (1c)), the frame that axes 1 ... n
// carry lies in the arm's base frame at
//   Pt = Pt_1 ... Pt_n,   Pt_j = F_j Tx(ax_j) Ty(ay_j) Rx(arx_j) Ry(ary_j) Rz(sgn_j e_j (1 + as_j))
// with e_j the controller's axis angle. The arm is seen from there: its base stands at Pt^-1.

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
};

/// Maximum number of axes.
constexpr int kMaxPositionerAxes = 2;

/// Errors of a positioner's axis.
enum class AxisError { kX, kY, kTurnX, kTurnY, kScale };
constexpr int kAxisErrors = 5;

}  // namespace cellcal::calib
