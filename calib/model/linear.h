#pragma once
// Random numbers that are identical on every platform: the standard specifies the generator but not
// its distributions.

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <span>
#include <vector>

namespace cellcal::calib {

/// A = L L' of a symmetric matrix; only the lower triangle is read.
class Cholesky {
 public:
  Cholesky() = default;
  explicit Cholesky(Eigen::MatrixXd symmetric);

  /// True if A is positive definite; a precondition of all other members.
  bool positive() const { return positive_; }

  Eigen::MatrixXd lower() const;          ///< L
  Eigen::MatrixXd lower_inverse() const;  ///< L^-1
  double log_det() const;                 ///< of A

  Eigen::VectorXd solve(const Eigen::VectorXd& b) const;  ///< A^-1 b
  Eigen::MatrixXd solve(const Eigen::MatrixXd& b) const;
  Eigen::MatrixXd inverse() const;                           ///< A^-1
  Eigen::VectorXd whitened(const Eigen::VectorXd& b) const;  ///< L^-1 b
  Eigen::MatrixXd whitened(const Eigen::MatrixXd& b) const;
  Eigen::VectorXd coloured(const Eigen::VectorXd& b) const;  ///< L'^-1 b

 private:
  auto triangle() const { return factor_.triangularView<Eigen::Lower>(); }

  Eigen::MatrixXd factor_;
  bool positive_ = false;
};

/// A^-1 b of a possibly singular matrix, by pivoted L D L'.
Eigen::VectorXd pivoted_solve(const Eigen::MatrixXd& symmetric, const Eigen::VectorXd& b);

/// b' A^-1 b, likewise; 0 if a pivot is negative.
template <int N>
double inverse_square(const Eigen::Matrix<double, N, N>& symmetric,
                      const Eigen::Matrix<double, N, 1>& b) {
  const Eigen::LDLT<Eigen::Matrix<double, N, N>> factor(symmetric);
  return factor.isPositive() ? b.dot(factor.solve(b)) : 0.0;
}

struct Eigenpairs {
  Eigen::VectorXd values;   ///< ascending
  Eigen::MatrixXd vectors;  ///< orthonormal, one column per value
};

/// Eigenpairs of a symmetric matrix; only the lower triangle is read.
Eigenpairs eigenpairs(const Eigen::MatrixXd& symmetric);

/// Eigenvalues only; faster than eigenpairs().
Eigen::VectorXd eigenvalues(const Eigen::MatrixXd& symmetric);

using SixColumns = Eigen::Matrix<double, Eigen::Dynamic, 6>;

/// Least-squares solution of A x = b by pivoted QR; 0 along undetermined directions.
Eigen::VectorXd least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);
Eigen::MatrixXd least_squares(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
Eigen::VectorXd least_squares(const SixColumns& a, const Eigen::VectorXd& b);
Eigen::Vector4d least_squares(const Eigen::MatrixX4d& a, const Eigen::VectorXd& b);

/// Orthonormal basis of the column span.
Eigen::MatrixXd orthonormal(const Eigen::MatrixXd& columns);

/// R of `rows` = Q R, with as many columns.
Eigen::MatrixXd triangle_of(Eigen::MatrixXd rows);

/// Q' A Q without the span of `columns`, for a symmetric A: Q maps their span to the first axes, which are
/// dropped. Directions smaller than `rounding` relative to the largest are ignored.
Eigen::MatrixXd without_span(Eigen::MatrixXd a, const Eigen::MatrixXd& columns, double rounding);

/// Singular values of a 3 x n matrix in descending order, and their directions in space.
struct PointSpread {
  Eigen::VectorXd values;
  Eigen::MatrixXd directions;
};
PointSpread spread_of(const Eigen::MatrixXd& points);

/// Motion that brings the points `from` nearest to `to`, one column each (Umeyama 1991, scale 1).
Eigen::Isometry3d rigid_motion(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to);

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  /// In [0, 1).
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1.0p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Standard normal (Box-Muller; the second of the pair is discarded to keep no state).
  double normal() {
    const double u = 1.0 - uniform();  // never 0
    return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * std::numbers::pi * uniform());
  }
  std::size_t below(std::size_t n) {
    return static_cast<std::size_t>(uniform() * static_cast<double>(n));
  }

 private:
  std::mt19937_64 engine_;
};

// Statistics of normal variables, and of likelihoods kept as logarithms.

/// Probability that a standard normal variable exceeds z.
inline double normal_above(double z) { return 0.5 * std::erfc(z / std::numbers::sqrt2); }

/// Logarithm of the sum of exponentials; minus infinity for an empty span.
inline double log_sum(std::span<const double> logs) {
  if (logs.empty()) return -std::numeric_limits<double>::infinity();
  const double most = *std::max_element(logs.begin(), logs.end());
  double sum = 0.0;
  for (const double one : logs) sum += std::exp(one - most);
  return most + std::log(sum);
}

/// Median of the absolute value of a standard normal variable.
inline constexpr double kNormalMedian = 0.6745;
/// Its inverse: sigma of normal variables per median absolute deviation.
inline constexpr double kMadToSigma = 1.4826;

/// Median; the upper of the two middle values for an even count. Requires at least one value.
inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Median as in result tables: mean of the two middle values for an even count, NaN for none.
inline double median_between(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const double upper = median(values);
  if (values.size() % 2 == 1) return upper;
  std::nth_element(values.begin(),
                   values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2 - 1),
                   values.end());
  return (values[values.size() / 2 - 1] + upper) / 2.0;
}

}  // namespace cellcal::calib
