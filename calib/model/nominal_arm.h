#pragma once
// The nominal arm with a rigid tool, without allocation, for cycles of milliseconds.
//
// Same chain as ArmModel::nominal_tcp, with the constant transforms multiplied out beforehand.

#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <vector>

#include "calib/model/robot.h"

namespace cellcal::calib {

class NominalArm {
 public:
  /// `tcp`: flange to TCP.
  NominalArm(const Robot& robot, const Eigen::Isometry3d& tcp);

  std::size_t joint_count() const { return joints_.size(); }
  /// TCP in the base frame; `joint_rad` has joint_count() values.
  Eigen::Isometry3d tcp(std::span<const double> joint_rad) const noexcept;

 private:
  struct Turn {
    double sign, offset_rad;
    std::optional<Eigen::Vector3d> along;  ///< of a linear unit
    Eigen::Isometry3d behind;              ///< to the next joint; after the last one to the TCP
  };
  Eigen::Isometry3d base_;
  std::vector<Turn> joints_;
};

}  // namespace cellcal::calib
