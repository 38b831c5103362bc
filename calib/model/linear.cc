#include "calib/model/linear.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>

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
  if (b.size() == 0) return b;  // Eigen dereferences the first element even of an empty vector
  return factor_.matrixL().solve(b);
}

Eigen::MatrixXd Cholesky::whitened(const Eigen::MatrixXd& b) const {
  if (b.size() == 0) return b;
  return factor_.matrixL().solve(b);
}

Eigen::VectorXd Cholesky::coloured(const Eigen::VectorXd& b) const {
  if (b.size() == 0) return b;
  return factor_.matrixU().solve(b);
}

Eigen::VectorXd pivoted_solve(const Eigen::MatrixXd& symmetric, const Eigen::VectorXd& b) {
  return symmetric.ldlt().solve(b);
}

namespace {

using Solver = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;

}  // namespace

Eigenpairs eigenpairs(const Eigen::MatrixXd& symmetric) {
  const Solver solver(symmetric);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::VectorXd eigenvalues(const Eigen::MatrixXd& symmetric) {
  return Solver(symmetric, Eigen::EigenvaluesOnly).eigenvalues();
}

Eigen::VectorXd least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b) {
  return a.colPivHouseholderQr().solve(b);
}

Eigen::MatrixXd least_squares(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a.colPivHouseholderQr().solve(b);
}

Eigen::VectorXd least_squares(const SixColumns& a, const Eigen::VectorXd& b) {
  return a.colPivHouseholderQr().solve(b);
}

Eigen::Vector4d least_squares(const Eigen::MatrixX4d& a, const Eigen::VectorXd& b) {
  return a.colPivHouseholderQr().solve(b);
}

Eigen::MatrixXd orthonormal(const Eigen::MatrixXd& columns) {
  return Eigen::HouseholderQR<Eigen::MatrixXd>(columns).householderQ() *
         Eigen::MatrixXd::Identity(columns.rows(), columns.cols());
}

Eigen::MatrixXd triangle_of(Eigen::MatrixXd rows) {
  const Eigen::HouseholderQR<Eigen::Ref<Eigen::MatrixXd>> in_place(rows);
  return rows.topRows(rows.cols()).triangularView<Eigen::Upper>();
}

Eigen::MatrixXd without_span(Eigen::MatrixXd a, const Eigen::MatrixXd& columns, double rounding) {
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> turned(columns);
  turned.setThreshold(rounding);
  a.applyOnTheLeft(turned.householderQ().transpose());
  a.applyOnTheRight(turned.householderQ());
  const Eigen::Index rest = a.rows() - turned.rank();
  return a.bottomRightCorner(rest, rest);
}

PointSpread spread_of(const Eigen::MatrixXd& points) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(points, Eigen::ComputeFullU);
  return {svd.singularValues(), svd.matrixU()};
}

}  // namespace cellcal::calib
