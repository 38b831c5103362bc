#pragma once
// Poses that matter, and what a covariance says about the TCP there.

#include <Eigen/Core>
#include <vector>

#include "calib/model/joint_vector.h"
#include "calib/model/kinematics.h"

namespace cellcal::calib {

/// Mean over rms of the norm of an isotropic 3-D Gaussian: sqrt(8 / (3 pi)).
inline constexpr double kMeanOverRms = 0.9213177319235613;

/// Random poses of the region in front of the arm where cells are: the first axis within 60 deg of
/// its middle, the others in the middle 75 % of their range but within 170 deg of zero, the tip
/// 50 mm above the arm's own foot, wherever [base] puts it and whichever way up; also below it for
/// an arm that hardly reaches above. `count` of them, the same for the same seed.
std::vector<JointVector> workspace_poses(const ArmModel& arm, int count, unsigned seed);

/// Poses near the given ones whose tip is within `half_m` (a cube) of one of the centres.
std::vector<JointVector> local_poses(const ArmModel& arm, const std::vector<JointVector>& around,
                                     const std::vector<Eigen::Vector3d>& centres_m, double half_m,
                                     int count, unsigned seed);

/// How a point moves with a motion of the base, per metre and radian about its origin.
Eigen::Matrix<double, 3, 6> base_motion(const Eigen::Vector3d& point_m);

/// Tips, and how they move per prior sigma of each arm parameter, 3 rows a pose [m].
struct TipMoves {
  Eigen::Matrix3Xd tips_m;
  Eigen::MatrixXd moves_m;
};
TipMoves tip_moves(const ArmModel& arm, const std::vector<JointVector>& poses, const double* x_si,
                   const Eigen::VectorXd& scale);

/// The moves, with what a motion of the base could do taken out (6-DoF alignment). Needs at least 3
/// poses.
Eigen::MatrixXd aligned(const TipMoves& at);
Eigen::MatrixXd aligned_moves(const ArmModel& arm, const std::vector<JointVector>& poses,
                              const double* x_si, const Eigen::VectorXd& scale);

/// Variance of the tip [m^2, summed over x, y, z] at each pose where every joint is off by
/// `ripple_rad`, 1 sigma: what stays, however much is known of the arm.
Eigen::VectorXd ripple_variance_m2(const ArmModel& arm, const std::vector<JointVector>& poses,
                                   double ripple_rad);

/// Tips of one set of parameters (null: nominal) from those of another [m], a motion of the base
/// taken out; a column a pose. Needs at least 3 poses.
Eigen::Matrix3Xd apart(const ArmModel& arm, const std::vector<JointVector>& poses,
                       const double* one_si, const double* other_si);

/// Mean 3-D position error [m] that `covariance_u` (arm parameters, prior units) predicts over the
/// poses of aligned_moves(), with the variance that stays at each. 0 for an empty set.
double predicted_mean_error_m(const Eigen::MatrixXd& moves, const Eigen::MatrixXd& covariance_u,
                              const Eigen::VectorXd& stays_m2);

// How far one arm's nominal model puts its tip off, after touches: what every place that shows it reads.

/// Mean 3-D distance of the nominal from the real tip over poses, a motion of the base taken out.
struct NominalError {
  double mean_m = 0.0;
  double u_m = 0.0;  ///< expanded uncertainty of that mean, k = 2
};

/// (41): the mean over arms drawn from the estimate and its covariance, of all poses such as these: U is of the arms
/// and of the draw of the poses. With a covariance that touches did not narrow it is what the tolerances foresee of
/// any such arm. `moves`: of aligned_moves() at
/// `x_si`, per unit of `covariance`; `stays_m2`: the variance at each pose that no parameter explains. Needs at
/// least 3 poses.
NominalError nominal_error(const ArmModel& arm, const std::vector<JointVector>& poses,
                           const double* x_si, const Eigen::MatrixXd& moves,
                           const Eigen::MatrixXd& covariance, const Eigen::VectorXd& stays_m2);

}  // namespace cellcal::calib
