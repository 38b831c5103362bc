#include "calib/linear/orthogonal.h"

#include <Eigen/QR>
#include <Eigen/SVD>

namespace cellcal::calib {

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

Spread spread_of(const Eigen::MatrixXd& points) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(points, Eigen::ComputeFullU);
  return {svd.singularValues(), svd.matrixU()};
}

}  // namespace cellcal::calib
