#pragma once
// Predicted TCP position by a calibration, and its uncertainty.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "calib/estimate/external_axes.h"
#include "calib/model/hidden.h"
#include "calib/model/joint_vector.h"
#include "calib/model/kinematics.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

struct Prediction {
  Eigen::Isometry3d tcp = Eigen::Isometry3d::Identity();  ///< frame of the predictor
  /// Radius that contains the position error at 95 % of the poses of the region where the base was
  /// measured, with 98 % confidence; excludes the position of that frame (PositionBound).
  double u95_m = 0.0;
};

/// Evaluates a calibration at poses. Holds copies of its data; cheap to call.
class Predictor {
 public:
  /// In the base frame; with `carriers` in the frame that so many of the positioner's axes carry.
  /// Throws PositionerError without any touched target there: nothing was measured of it.
  explicit Predictor(const Calibration& calibration, int carriers = 0);

  /// `carrier_rad`: angles of those axes; `outer_rad`: of the axes after them, which load them; empty:
  /// 0. Throws std::invalid_argument for another number.
  Prediction calibrated(std::span<const double> joint_rad, std::span<const double> carrier_rad = {},
                        std::span<const double> outer_rad = {}) const;
  /// Predicted mean 3-D error [m] over at least 3 poses after alignment by a base motion; excludes
  /// gear errors beyond the model. 0 without covariance.
  double mean_error_m(const std::vector<JointVector>& poses) const;
  Eigen::Isometry3d nominal(std::span<const double> joint_rad,
                            std::span<const double> carrier_rad = {}) const;

 private:
  struct Impl;
  Hidden<Impl> impl_;
};

/// Where a calibration holds: anywhere in scope "workspace", else near its targets, or near the
/// touched postures where a tracker measured.
class Scope {
 public:
  explicit Scope(const Calibration& calibration);
  /// True within 150 mm, per coordinate, of one of them; `tcp_m` in the base frame, or in that which
  /// the first `carriers` axes of a positioner carry.
  bool holds_at(const Eigen::Vector3d& tcp_m, int carriers = 0) const;

 private:
  struct Place {
    Eigen::Vector3d place_m;
    int carriers;
  };
  bool workspace_;
  std::vector<Place> near_;
};

// Bound u95 of the TCP position error: a radius about the predicted position.
//
// It excludes the position of the base frame: a convention of six numbers, which no touch in the
// cell can determine and which each user sets again by measuring a base; the motion that this base
// can absorb is therefore removed. The region where the base is measured is unknown: the whole
// workspace, or its left, right, near, far, low or high half. The difference between these regions
// counts as uncertainty too; without it an arm of unknown scale would appear exact in the middle of
// the workspace. A tracker measures the base itself, over the postures that it saw: the bound grows
// away from them.
// On a positioner the frame that it carries takes the base's place: a user measures a base on the table, at
// all angles or at the lower or upper half of those of an axis.
// The errors of one arm are correlated between poses: where the estimate is off, it is off at many
// poses. The radii are therefore widened so that, with 98 % confidence, they contain the error at
// 95 % of the poses where the base of the individual arm was measured, rather than at 95 % of all
// poses of all arms.

/// Radius that contains 95 % of a 3-D Gaussian with covariance c: the sum of squares is matched to
/// a scaled chi^2 (Satterthwaite), its quantile approximated by Wilson and Hilferty.
double radius_95(const Eigen::Matrix3d& c);

/// Ripple of each joint away from the touches, 1 sigma: sqrt 2 times that among them, and less where many rows have
/// determined it. Few touches do not distinguish its part common to all of them, such as play that the load closes to one
/// side, from the geometry.
double ripple_elsewhere_rad(double ripple_rad, double rows = 0.0);
double ripple_elsewhere_rad(const Calibration& c);

class PositionBound {
 public:
  /// `x`, `covariance`: of the arm's parameters, SI. `ripple_rad`: of each joint at the poses asked for, 1 sigma.
  /// `field_m`: model discrepancy (discrepancy.h), 1 sigma per component of the tip position. Keeps
  /// a reference to `arm`. `measured`: postures that span where the base was measured
  /// (Calibration::region); empty: the workspace, or a half of it.
  PositionBound(const ArmModel& arm, const Eigen::VectorXd& x, Eigen::MatrixXd covariance,
                double ripple_rad, double field_m = 0.0,
                const std::vector<JointVector>& measured = {});
  /// Uncertainty of tips in the frame that the positioner's axes carry, measured there at poses like these.
  PositionBound(const ArmModel& arm, const Eigen::VectorXd& x, Eigen::MatrixXd covariance,
                double ripple_rad, double field_m, const std::vector<CarriedPose>& on_positioner);

  /// u95 [m] at a pose with the given tip and its derivative by the parameters (3 x parameters).
  double u95_m(std::span<const double> joint_rad, const Eigen::Vector3d& tip,
               const Eigen::Matrix3Xd& jacobian, std::span<const double> carrier_rad = {}) const;
  /// (36), of a vector with this derivative by the parameters and by the base's motion (region.h,
  /// base_motion); without ripple and field.
  Eigen::Matrix3d covariance(const Eigen::Matrix3Xd& jacobian,
                             const Eigen::Matrix<double, 3, 6>& base) const;
  /// Mean u95 [m] over postures; 0 without any.
  double mean_u95_m(std::span<const JointVector> postures) const;

 private:
  /// (36) and (39). `halves`: the base may also be measured in half of the poses.
  void spread_over(const std::vector<CarriedPose>& poses, bool halves);

  const ArmModel& arm_;
  Eigen::VectorXd x_;
  Eigen::MatrixXd covariance_;
  double ripple_rad_, field_m_;
  /// 6 x parameters: base motion that absorbs each parameter, mean over the regions.
  Eigen::MatrixXd taken_up_;
  /// Covariance of that motion between regions.
  Eigen::Matrix<double, 6, 6> base_covariance_ = Eigen::Matrix<double, 6, 6>::Zero();
  double widening_ = 1.0;
};

}  // namespace cellcal::calib
