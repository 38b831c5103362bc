#pragma once
// What any number of rows say about the unknowns, in a triangle of fixed size: U and r_U with
// |J du + r|^2 = |U du + r_U|^2 + rest^2 for every step du (square-root information). A least-squares
// solver that is given U and r_U in place of J and r takes the same steps at the same cost, however
// many rows there were.

#include <Eigen/Core>

namespace cellcal::calib {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

class Information {
 public:
  /// `all_digits`: by QR, block on block, which loses none. Otherwise by J'J, which loses half of
  /// them and is several times faster.
  Information(Eigen::Index unknowns, bool all_digits);

  /// Rows [J r]: one column per unknown and the residual behind them.
  void add(const Eigen::Ref<const RowMajor>& rows);
  /// All that another of as many unknowns has, gathered likewise.
  void add(const Information& other);
  /// A row for each unknown alone, such as its prior: weight * step + residual.
  void add_alone(const Eigen::VectorXd& weight, const Eigen::VectorXd& residual);

  /// Upper triangular [U r_U; 0 rest], one row and column more than there are unknowns. Where J'J
  /// leaves an unknown undetermined its diagonal is 0.
  Eigen::MatrixXd triangle() const;

 private:
  bool all_digits_;
  Eigen::MatrixXd sum_;  ///< [J r]'[J r], lower part; with all digits the triangle so far
};

}  // namespace cellcal::calib
