#pragma once
// Where the TCP really is, by a calibration, and how sure that is.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <span>
#include <vector>

#include "calib/model/joint_vector.h"
#include "calib/model/kinematics.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

struct Prediction {
  Eigen::Isometry3d tcp = Eigen::Isometry3d::Identity();  ///< base frame
  /// Radius that holds the position error at 95 % of the region where the
  /// base was fixed, with 98 % confidence; where the
  /// base frame lies is left aside (calib/estimate/predict.h).
  double u95_m = 0.0;
};

/// Evaluates a calibration at poses. Holds its own copies; cheap to call.
class Predictor {
 public:
  explicit Predictor(const Calibration& calibration);
  ~Predictor();
  Predictor(Predictor&&) noexcept;

  Prediction calibrated(std::span<const double> joint_rad) const;
  /// Mean 3-D error over at least 3 poses that the covariance foresees, a motion of the base taken
  /// out; what gears do beside the model is not in it. 0 without covariance.
  double mean_error_m(const std::vector<JointVector>& poses) const;
  Eigen::Isometry3d nominal(std::span<const double> joint_rad) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

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
