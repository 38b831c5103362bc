#pragma once

#include <Eigen/Core>

namespace cellcal::calib {

using SixColumns = Eigen::Matrix<double, Eigen::Dynamic, 6>;

/// The x that brings A x nearest to b, by QR with pivots; the directions that A does not tell are 0.
Eigen::VectorXd least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);
Eigen::MatrixXd least_squares(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
Eigen::VectorXd least_squares(const SixColumns& a, const Eigen::VectorXd& b);
Eigen::Vector4d least_squares(const Eigen::MatrixX4d& a, const Eigen::VectorXd& b);

/// An orthonormal basis of what the columns span.
Eigen::MatrixXd orthonormal(const Eigen::MatrixXd& columns);

/// R of `rows` = Q R, as wide as they are.
Eigen::MatrixXd triangle_of(Eigen::MatrixXd rows);

/// Q' A Q without what `columns` span, of a symmetric A: Q turns their span into the first axes, which are
/// dropped. What of them is smaller than `rounding` beside the largest counts for nothing.
Eigen::MatrixXd without_span(Eigen::MatrixXd a, const Eigen::MatrixXd& columns, double rounding);

/// Of a 3 x n matrix: singular values, the largest first, and their directions in space.
struct Spread {
  Eigen::VectorXd values;
  Eigen::MatrixXd directions;
};
Spread spread_of(const Eigen::MatrixXd& points);

}  // namespace cellcal::calib
