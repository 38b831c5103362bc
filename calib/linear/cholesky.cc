#include "calib/linear/cholesky.h"

namespace cellcal::calib {

Cholesky::Cholesky(const Eigen::MatrixXd& symmetric) : factor_(symmetric) {}

Eigen::MatrixXd Cholesky::lower() const { return factor_.matrixL(); }

double Cholesky::log_det() const {
  return 2.0 * factor_.matrixLLT().diagonal().array().log().sum();
}

Eigen::VectorXd Cholesky::solve(const Eigen::VectorXd& b) const { return factor_.solve(b); }

Eigen::MatrixXd Cholesky::solve(const Eigen::MatrixXd& b) const { return factor_.solve(b); }

Eigen::MatrixXd Cholesky::inverse() const {
  const Eigen::Index n = factor_.rows();
  return factor_.solve(Eigen::MatrixXd::Identity(n, n));
}

Eigen::VectorXd Cholesky::whitened(const Eigen::VectorXd& b) const {
  return factor_.matrixL().solve(b);
}

Eigen::MatrixXd Cholesky::whitened(const Eigen::MatrixXd& b) const {
  if (b.size() == 0) return b;  // Eigen refers to the first element, be there one or not
  return factor_.matrixL().solve(b);
}

Eigen::VectorXd Cholesky::coloured(const Eigen::VectorXd& b) const {
  return factor_.matrixU().solve(b);
}

Eigen::VectorXd pivoted_solve(const Eigen::MatrixXd& symmetric, const Eigen::VectorXd& b) {
  return symmetric.ldlt().solve(b);
}

}  // namespace cellcal::calib
