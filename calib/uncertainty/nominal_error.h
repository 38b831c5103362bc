#pragma once
// How far one arm's nominal model puts its tip off, after touches: what every place that shows it reads.

#include <Eigen/Core>
#include <vector>

#include "calib/model/joint_vector.h"
#include "calib/model/kinematics.h"

namespace cellcal::calib {

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
