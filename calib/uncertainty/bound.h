#pragma once
// How far the TCP may be from where a calibration says it is.
//
// u95 is a radius about the predicted position. It leaves aside where the base frame lies: that is
// a convention of six numbers, which no touch in the cell can tell and which every user fixes anew
// by measuring a base; so what a motion of the base could take up is taken out. Where that base is
// measured nobody knows: over the whole workspace, or over the left, right, near, far, low or high
// half of it. What is left differs from one to the other, which counts as uncertainty, too; without
// it an arm of unknown scale would be taken for exact in the middle of the workspace.
// The errors of one arm go together: where the estimate is off, it is off at many poses at once.
// So the radii are widened until, at 98 % confidence, they hold at 95 % of the poses where the base
// of the one arm there is was fixed, and not merely at 95 % of all poses of all arms.

#include <Eigen/Core>

#include "calib/model/joint_vector.h"
#include "calib/model/kinematics.h"

namespace cellcal::calib {

/// Radius that holds 95 % of a 3-D Gaussian with covariance c: the weighted sum of squares is
/// matched to a scaled chi^2 (Satterthwaite), its quantile taken by Wilson and Hilferty.
double radius_95(const Eigen::Matrix3d& c);

class PositionBound {
 public:
  /// `x`, `covariance`: of the arm's parameters, SI. `ripple_rad`: noise of each joint, 1 sigma.
  /// `field_m`: what the model lacks (discrepancy.h), 1 sigma of each component of the tip's place.
  /// Keeps a reference to the arm.
  PositionBound(const ArmModel& arm, const Eigen::VectorXd& x, Eigen::MatrixXd covariance,
                double ripple_rad, double field_m = 0.0);

  /// At a pose whose tip and derivative by the parameters are these.
  double u95_m(std::span<const double> joint_rad, const Eigen::Vector3d& tip,
               const Eigen::Matrix3Xd& jacobian) const;
  /// Mean over postures; 0 without any.
  double mean_u95_m(std::span<const JointVector> postures) const;

 private:
  const ArmModel& arm_;
  Eigen::VectorXd x_;
  Eigen::MatrixXd covariance_;
  double ripple_rad_, field_m_;
  /// 6 x parameters: the base motion that takes up each, in the mean over where a base is fixed.
  Eigen::MatrixXd taken_up_;
  /// How far that differs from where to where.
  Eigen::Matrix<double, 6, 6> base_covariance_ = Eigen::Matrix<double, 6, 6>::Zero();
  double widening_ = 1.0;
};

}  // namespace cellcal::calib
