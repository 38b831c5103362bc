#pragma once
// Square-root information: the least-squares information of any number of rows on the unknowns, as
// a triangle of fixed size: U and r_U with |J du + r|^2 = |U du + r_U|^2 + rest^2 for every step
// du. A least-squares solver with U and r_U in place of J and r takes the same steps at the same
// cost, whatever the number of rows.

#include <Eigen/Core>

namespace cellcal::calib {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

class Information {
 public:
  /// `all_digits`: by QR, block by block, at full precision. Otherwise by J'J, which loses half of
  /// the digits and is several times faster.
  Information(Eigen::Index unknowns, bool all_digits);

  /// Rows [J r]: one column per unknown, then the residual.
  void add(const Eigen::Ref<const RowMajor>& rows);
  /// Adds the information of `other`, which has the same unknowns and the same method.
  void add(const Information& other);
  /// Adds a row per unknown, such as its prior: weight * step + residual.
  void add_alone(const Eigen::VectorXd& weight, const Eigen::VectorXd& residual);

  /// Upper triangle [U r_U; 0 rest], one row and column more than there are unknowns. If J'J leaves
  /// an unknown undetermined, its diagonal element is 0.
  Eigen::MatrixXd triangle() const;

 private:
  bool all_digits_;
  Eigen::MatrixXd sum_;  ///< [J r]'[J r], lower part; with all digits the current triangle
};

}  // namespace cellcal::calib
