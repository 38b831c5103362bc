#pragma once

#include <Eigen/Core>

namespace cellcal::calib {

struct Eigenpairs {
  Eigen::VectorXd values;   ///< rising
  Eigen::MatrixXd vectors;  ///< orthonormal, a column for each value
};

/// Of a symmetric matrix, of which the lower part is read.
Eigenpairs eigenpairs(const Eigen::MatrixXd& symmetric);

/// Alone, and sooner than with the vectors.
Eigen::VectorXd eigenvalues(const Eigen::MatrixXd& symmetric);

}  // namespace cellcal::calib
