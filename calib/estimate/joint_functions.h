#pragma once
// Parts of the arm's model by evidence: compliance of the joints across their axes, and transmission
// errors as random functions of each joint's own angle. An arm has them only if the touches show
// them. The functions are Fourier series whose coefficients have the variances of a Matern-3/2
// kernel (calib/model/README.md), so that they are unknowns as any other of the arm.

#include <optional>
#include <vector>

#include "calib/estimate/estimate.h"
#include "calib/estimate/repeats.h"

namespace cellcal::calib {

/// The cell, its joints with the bearings and functions of that robot.
Cell with_learnt_of(const Robot& robot, Cell cell);

/// Joints compliant across their axes; `share` of the prior of the compliance about the axis, of a
/// joint without one (A1 of an upright arm bears no torque) that of the next joint that has one.
Robot with_bearings(Robot robot, double share);
/// True if residuals of touches that `richer` correlates are correlated, (30). `e`: the estimate of
/// `plain`, which lacks the additional unknowns of `richer`.
bool speaks_for(const Problem& plain, Problem& richer, const Estimate& e);

/// True if a joint has a function of its angle or single waves.
bool has_functions(const Robot& robot);

/// The robot with the sizes and the reach of its joints' functions by restricted likelihood; none
/// where the residuals of touches that share joint angles are uncorrelated, (30). `e`: the estimate
/// of `problem`, which lacks functions.
std::optional<Robot> size_functions(const Problem& problem, const Repeats& repeats,
                                    const Estimate& e);

/// The robot with fast orders in the functions that show them; none where no function does. `e`: the
/// estimate of `problem`, every joint of which has a function.
std::optional<Robot> size_fast_orders(const Problem& problem, const Repeats& repeats,
                                      const Estimate& e);

/// log evidence of `richer` minus that of `plain`, whose estimate `e` is, at the likely levels.
double evidence_gain(const Problem& plain, Problem& richer, const Estimate& e);

/// The estimate of `richer`, from that of `plain`. Throws IdentifyError.
Estimate estimate_richer(const Problem& plain, Problem& richer, const IdentifyOptions& options,
                         const std::vector<ModelLevel>& levels, const Estimate& e);

/// Estimates `played`, an arm with play that the load closes, starting from the estimate `e` of
/// `plain`, the same arm without. Returns true and replaces `e` if the touches raise the odds of play
/// above its prior odds; otherwise leaves `e` unchanged. weigh_repeats() has been applied to both
/// problems.
bool estimate_with_play(const Problem& plain, Problem& played, const IdentifyOptions& options,
                        Estimate& e);

// Single waves of the joints' gears: a pinion's or a wave generator's order, faster than a smooth
// function of the angle can follow from touch to touch, is one sine and one cosine. All orders of all
// joints are tried against what the touches leave.

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

/// Rows of the joints that turn, whitened as those of the linearisation at u. The bending of the tool,
/// and rows of rotations, are left out.
std::vector<RowsOfJoint> rows_by_joint(const Problem& problem, const Eigen::VectorXd& u,
                                       const MeanRows& mean);

/// lever times cosine and sine of the orders from `lowest` to `highest`: 2 columns per order.
Eigen::MatrixXd waves_of(const RowsOfJoint& rows, int lowest, int highest);

}  // namespace cellcal::calib
