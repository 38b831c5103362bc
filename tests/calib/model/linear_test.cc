#include "calib/model/linear.h"

#include <gtest/gtest.h>

#include <cmath>

namespace cellcal::calib {
namespace {

constexpr double kRounding = 1e-11;

Eigen::MatrixXd drawn(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
  Random random(seed);
  Eigen::MatrixXd all(rows, columns);
  for (double& value : all.reshaped()) value = random.normal();
  return all;
}

Eigen::MatrixXd positive(Eigen::Index size, unsigned seed) {
  const Eigen::MatrixXd rows = drawn(2 * size, size, seed);
  return rows.transpose() * rows;
}

double apart(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a.size() == 0 ? 0.0 : (a - b).cwiseAbs().maxCoeff();
}

TEST(Cholesky, SolvesWithAVectorAndWithAMatrix) {
  const Eigen::MatrixXd a = positive(9, 1), many = drawn(9, 4, 2);
  const Eigen::VectorXd one = many.col(0);
  const Cholesky factor(a);
  ASSERT_TRUE(factor.positive());
  EXPECT_LT(apart(a * factor.solve(one), one), kRounding);
  EXPECT_LT(apart(a * factor.solve(many), many), kRounding);
  EXPECT_LT(apart(a * factor.inverse(), Eigen::MatrixXd::Identity(9, 9)), kRounding);
}

TEST(Cholesky, HasALowerTriangleWhoseSquareIsTheMatrix) {
  const Eigen::MatrixXd a = positive(9, 3);
  const Cholesky factor(a);
  const Eigen::MatrixXd lower = factor.lower();
  EXPECT_LT(apart(lower * lower.transpose(), a), kRounding);
  EXPECT_EQ(lower(0, 8), 0.0);
  EXPECT_NEAR(factor.log_det(), eigenvalues(a).array().log().sum(), kRounding);
}

TEST(Cholesky, WhitensWithTheLowerTriangleAndColoursWithTheUpper) {
  const Eigen::MatrixXd a = positive(9, 4), many = drawn(9, 3, 5);
  const Eigen::VectorXd one = many.col(1);
  const Cholesky factor(a);
  const Eigen::MatrixXd lower = factor.lower();
  EXPECT_LT(apart(lower * factor.whitened(one), one), kRounding);
  EXPECT_LT(apart(lower * factor.whitened(many), many), kRounding);
  EXPECT_LT(apart(lower.transpose() * factor.coloured(one), one), kRounding);
}

TEST(Cholesky, ReadsTheLowerPartAlone) {
  Eigen::MatrixXd a = positive(5, 6);
  const Eigen::MatrixXd lower = Cholesky(a).lower();
  a(0, 4) = 1e9;
  EXPECT_EQ(apart(Cholesky(a).lower(), lower), 0.0);
}

TEST(Cholesky, OfWhatIsNotPositiveSaysSo) {
  Eigen::MatrixXd a = positive(5, 7);
  a(2, 2) = -1.0;
  EXPECT_FALSE(Cholesky(a).positive());
}

TEST(Cholesky, WhitensNothingToNothing) {
  EXPECT_EQ(Cholesky(positive(3, 8)).whitened(Eigen::MatrixXd(3, 0)).cols(), 0);
  EXPECT_EQ(Cholesky(Eigen::MatrixXd(0, 0)).whitened(Eigen::MatrixXd(0, 4)).cols(), 4);
}

TEST(Pivots, SolveWhatIsNotPositive) {
  Eigen::MatrixXd a = positive(6, 9);
  a(1, 1) -= 40.0;
  const Eigen::VectorXd b = drawn(6, 1, 10);
  const Eigen::VectorXd x = pivoted_solve(a, b);
  const Eigen::MatrixXd whole = a.selfadjointView<Eigen::Lower>();
  EXPECT_LT((whole * x - b).norm(), 1e-9);
}

TEST(Pivots, WeighAVectorByTheInverseUnlessADirectionIsNegative) {
  Eigen::MatrixXd a = Eigen::Vector2d(4.0, 0.25).asDiagonal();
  const Eigen::VectorXd b = Eigen::Vector2d(2.0, 1.0);
  EXPECT_NEAR(inverse_square(a, b), 5.0, kRounding);
  a(1, 1) = -0.25;
  EXPECT_EQ(inverse_square(a, b), 0.0);
}

TEST(Eigenpairs, RiseAndPutTheMatrixTogetherAgain) {
  const Eigen::MatrixXd a = positive(8, 11);
  const auto [values, vectors] = eigenpairs(a);
  EXPECT_LT(apart(vectors * values.asDiagonal() * vectors.transpose(), a), kRounding);
  EXPECT_LT(apart(vectors.transpose() * vectors, Eigen::MatrixXd::Identity(8, 8)), kRounding);
  for (Eigen::Index k = 1; k < 8; ++k) EXPECT_LE(values[k - 1], values[k]);
  EXPECT_LT(apart(eigenvalues(a), values), kRounding);
}

TEST(LeastSquares, LeavesWhatNoColumnReaches) {
  const Eigen::MatrixXd a = drawn(20, 6, 12), many = drawn(20, 3, 13);
  const Eigen::VectorXd one = many.col(2);
  EXPECT_LT(apart(a.transpose() * (a * least_squares(a, one) - one), Eigen::VectorXd::Zero(6)),
            kRounding);
  EXPECT_LT(apart(a.transpose() * (a * least_squares(a, many) - many), Eigen::MatrixXd::Zero(6, 3)),
            kRounding);
  EXPECT_LT(apart(least_squares(SixColumns(a), one), least_squares(a, one)), kRounding);
  const Eigen::MatrixX4d four = a.leftCols<4>();
  EXPECT_LT(apart(least_squares(four, one), least_squares(Eigen::MatrixXd(four), one)), kRounding);
}

TEST(Orthonormal, SpansWhatTheColumnsSpan) {
  const Eigen::MatrixXd columns = drawn(9, 3, 14), basis = orthonormal(columns);
  EXPECT_LT(apart(basis.transpose() * basis, Eigen::MatrixXd::Identity(3, 3)), kRounding);
  EXPECT_LT(apart(basis * (basis.transpose() * columns), columns), kRounding);
}

TEST(TriangleOf, HasTheSquareOfTheRows) {
  const Eigen::MatrixXd rows = drawn(12, 5, 15), triangle = triangle_of(rows);
  EXPECT_LT(apart(triangle.transpose() * triangle, rows.transpose() * rows), kRounding);
  EXPECT_EQ(triangle(4, 0), 0.0);
}

TEST(WithoutSpan, DropsAsManyDirectionsAsTheColumnsHave) {
  const Eigen::MatrixXd a = positive(7, 16);
  Eigen::MatrixXd columns = drawn(7, 3, 17);
  columns.col(2) = columns.col(0) - columns.col(1);  // two directions
  const Eigen::MatrixXd rest = without_span(a, columns, 1e-9);
  ASSERT_EQ(rest.rows(), 5);
  const Eigen::MatrixXd basis = orthonormal(columns.leftCols(2));
  const Eigen::MatrixXd off = Eigen::MatrixXd::Identity(7, 7) - basis * basis.transpose();
  EXPECT_NEAR(rest.trace(), (off * a * off).trace(), 1e-9);
}

TEST(SpreadOf, PointsNearAPlaneIsLeastAcrossIt) {
  Eigen::MatrixXd points = drawn(3, 30, 18);
  points.row(2) *= 1e-3;
  const PointSpread spread = spread_of(points);
  EXPECT_GT(spread.values[1], 100.0 * spread.values[2]);
  EXPECT_GT(std::abs(spread.directions(2, 2)), 0.999);
}

}  // namespace
}  // namespace cellcal::calib
