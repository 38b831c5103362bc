#pragma once
// Single waves of the joints' gears: a pinion's or a wave generator's order, faster than a smooth
// function of the angle can follow from touch to touch, is one sine and one cosine. All orders of all
// joints are tried against what the touches leave.

#include <vector>

#include "calib/estimate/estimate.h"

namespace cellcal::calib {

struct FoundWaves {
  Robot robot;  ///< of the problem, its joints with the waves found
  int count = 0;
  /// Gain of log evidence that they need beyond chance, all orders of all joints having been tried.
  double required_gain = 0.0;
};

/// Adds wave by wave the one that raises the restricted likelihood most, until none raises it by
/// more than the search among all of them gains by chance, (27e). `e`: the estimate of `problem`.
FoundWaves find_waves(const Problem& problem, const Estimate& e);

// The touches' rows by the angle of each joint: how all that a gear adds to the angle moves them.

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
