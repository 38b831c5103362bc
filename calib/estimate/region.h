#pragma once
// Poses of the workspace, and TCP errors that a covariance predicts there.

#include <Eigen/Core>
#include <functional>
#include <span>
#include <vector>

#include "calib/model/joint_vector.h"
#include "calib/model/kinematics.h"
#include "calib/model/touch.h"

namespace cellcal::calib {

/// Mean over rms of the norm of an isotropic 3-D Gaussian: sqrt(8 / (3 pi)).
inline constexpr double kMeanOverRms = 0.9213177319235613;

/// Poses whose tip is so close to a target, per coordinate, count as near it.
inline constexpr double kNearTargetM = 0.150;
/// Fewest poses for an alignment by a base motion to leave a remainder.
inline constexpr std::size_t kFewestPoses = 3;
/// Seed of the poses of all figures of a calibration.
inline constexpr unsigned kRegionSeed = 20240924;

/// Random poses of the region in front of the arm where cells are: the first axis within 60 deg of
/// its middle, the others in the middle 75 % of their range but within 170 deg of zero, the tip
/// 50 mm above the arm's foot, in any orientation of [base]; also below the foot for an arm that
/// hardly reaches above. `count` of them, reproducible by `seed`.
std::vector<JointVector> workspace_poses(const ArmModel& arm, int count, unsigned seed);

/// Poses near the given ones whose tip is near one of the centres.
std::vector<JointVector> local_poses(const ArmModel& arm, const std::vector<JointVector>& around,
                                     const std::vector<Eigen::Vector3d>& centres_m, int count,
                                     unsigned seed);

/// Postures where trackers alone measured the arm: at most 60 of the fit touches, of those in `use`
/// unless it is empty. None if a target of another kind was touched.
std::vector<JointVector> tracker_region(const Cell& cell, std::span<const Touch> touches,
                                        const std::vector<bool>& use = {});

/// Random poses on the straight lines, in joint angles, between any two of the postures.
std::vector<JointVector> poses_between(const std::vector<JointVector>& postures, int count,
                                       unsigned seed);

/// Motion of a point per metre of translation and radian of rotation of the base about its origin.
Eigen::Matrix<double, 3, 6> base_motion(const Eigen::Vector3d& point_m);
/// Of several points, 3 rows each.
Eigen::Matrix<double, Eigen::Dynamic, 6> base_motions(const Eigen::Matrix3Xd& points_m);

/// Tips, and their motion per prior sigma of each arm parameter, 3 rows per pose [m]. `scale`: prior
/// sigmas; empty: per SI unit instead.
struct TipMoves {
  Eigen::Matrix3Xd tips_m;
  Eigen::MatrixXd moves_m;
};
TipMoves tip_moves(const ArmModel& arm, std::size_t count,
                   const std::function<PreparedPose(std::size_t)>& pose, const double* x_si,
                   const Eigen::VectorXd& scale = {});
TipMoves tip_moves(const ArmModel& arm, std::span<const JointVector> poses, const double* x_si,
                   const Eigen::VectorXd& scale = {});

/// Moves after alignment by a 6-DoF base motion. Needs at least 3 poses.
Eigen::MatrixXd aligned(const TipMoves& at);
Eigen::MatrixXd aligned_moves(const ArmModel& arm, const std::vector<JointVector>& poses,
                              const double* x_si, const Eigen::VectorXd& scale = {});

/// Variance of the tip [m^2, summed over x, y, z] at each pose due to an error of `ripple_rad`,
/// 1 sigma, in every joint: the part that no number of touches reduces.
Eigen::VectorXd ripple_variance_m2(const ArmModel& arm, const std::vector<JointVector>& poses,
                                   double ripple_rad);

/// Tips with one set of parameters (null: nominal) minus those with another [m], after alignment by
/// a base motion; a column per pose. Needs at least 3 poses.
Eigen::Matrix3Xd apart(const ArmModel& arm, const std::vector<JointVector>& poses,
                       const double* one_si, const double* other_si);

/// Mean 3-D position error [m] that `covariance_u` (arm parameters, prior units) predicts over the
/// poses of aligned_moves(). `stays_m2`: irreducible variance at each pose. 0 for an empty set.
double predicted_mean_error_m(const Eigen::MatrixXd& moves, const Eigen::MatrixXd& covariance_u,
                              const Eigen::VectorXd& stays_m2);

// Position error of an arm's nominal model after touches; common to all reports of it.

/// Mean 3-D distance of nominal and actual tip over poses after alignment by a base motion.
struct NominalError {
  double mean_m = 0.0;
  double u_m = 0.0;  ///< expanded uncertainty of that mean, k = 2
};

/// Arms drawn from a covariance, which may be singular: a column of deviations each. The same for
/// all regions of one calibration.
Eigen::MatrixXd drawn_arms(const Eigen::MatrixXd& covariance);

/// (41): mean over the drawn arms, and over all poses of the region that `poses` sample: u_m
/// includes the spread of the arms and of the sample. With arms drawn from tolerances alone it is
/// the expected error of any such arm. `moves`: of aligned_moves() at `x_si`, per unit of `arms`;
/// `stays_m2`: variance at each pose that no parameter explains. Needs at least 3 poses.
NominalError nominal_error(const ArmModel& arm, const std::vector<JointVector>& poses,
                           const double* x_si, const Eigen::MatrixXd& moves,
                           const Eigen::MatrixXd& arms, const Eigen::VectorXd& stays_m2);

}  // namespace cellcal::calib
