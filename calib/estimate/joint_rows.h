#pragma once
// The touches' rows by the angle of each joint: how all that a gear adds to the angle moves them.

#include <vector>

#include "calib/estimate/estimate.h"

namespace cellcal::calib {

struct RowsOfJoint {
  std::size_t joint = 0;
  Eigen::VectorXd lever;      ///< per row: change of the residual per radian about the axis
  Eigen::VectorXd angle_rad;  ///< per row: the joint's angle
};

/// Of the joints that turn, over the touches' rows of the estimate's linearisation, whitened. The
/// bending of the tool, and rows of rotations, are left out.
std::vector<RowsOfJoint> rows_by_joint(const Problem& problem, const Estimate& e);

/// lever times cosine and sine of the orders from `lowest` to `highest`: 2 columns per order.
Eigen::MatrixXd waves_of(const RowsOfJoint& rows, int lowest, int highest);

}  // namespace cellcal::calib
