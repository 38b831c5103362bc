#pragma once
// The nominal arm with a stiff tool, without allocation: for cycles of milliseconds.
//
// The same chain as ArmModel::nominal_tcp, with all that does not turn multiplied out beforehand.

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "calib/model/robot.h"

namespace cellcal::calib {

class NominalArm {
 public:
  /// `tcp`: flange to TCP.
  NominalArm(const Robot& robot, const Eigen::Isometry3d& tcp);

  std::size_t joint_count() const { return joints_.size(); }
  /// Flange to TCP, seen from the base; `joint_rad` has joint_count() values.
  Eigen::Isometry3d tcp(std::span<const double> joint_rad) const noexcept;

 private:
  struct Turn {
    double sign, offset_rad;
    Eigen::Isometry3d behind;  ///< up to the next joint; behind the last up to the TCP
  };
  Eigen::Isometry3d base_;
  std::vector<Turn> joints_;
};

}  // namespace cellcal::calib
