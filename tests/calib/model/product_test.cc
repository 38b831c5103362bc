// Products against their definition, bit for bit.

#include "calib/model/product.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "calib/model/linear.h"

namespace cellcal::calib {
namespace {

Eigen::MatrixXd random_matrix(Random& random, Eigen::Index rows, Eigen::Index columns) {
  Eigen::MatrixXd m(rows, columns);
  for (Eigen::Index c = 0; c < columns; ++c)
    for (Eigen::Index r = 0; r < rows; ++r) m(r, c) = random.normal();
  return m;
}

/// sum += weight a b, term by term in order.
void add_by_definition(double weight, const Eigen::MatrixXd& a, const Eigen::MatrixXd& b,
                       Eigen::MatrixXd& sum) {
  for (Eigen::Index from = 0; from < a.cols(); from += kProductDepth)
    for (Eigen::Index r = 0; r < sum.rows(); ++r)
      for (Eigen::Index c = 0; c < sum.cols(); ++c) {
        double terms = 0.0;
        for (Eigen::Index k = from; k < std::min(from + kProductDepth, a.cols()); ++k)
          terms += a(r, k) * b(k, c);
        sum(r, c) += weight * terms;
      }
}

struct Size {
  Eigen::Index rows, depth, columns;
};
const std::array<Size, 9> kSizes = {{{0, 3, 2},
                                     {3, 0, 2},
                                     {1, 1, 1},
                                     {3, 2, 5},
                                     {16, 4, 4},
                                     {17, 9, 5},
                                     {33, 40, 61},
                                     {100, 257, 99},
                                     {300, 70, 20}}};

TEST(Product, IsTheSumOfItsTermsInOrderToTheBit) {
  Random random(1);
  for (const Size& size : kSizes) {
    SCOPED_TRACE(size.rows);
    const Eigen::MatrixXd a = random_matrix(random, size.rows, size.depth);
    const Eigen::MatrixXd b = random_matrix(random, size.depth, size.columns);
    Eigen::MatrixXd sum = random_matrix(random, size.rows, size.columns), expected = sum;
    add_by_definition(-0.3, a, b, expected);
    add_product(-0.3, a, b, sum);
    EXPECT_TRUE(sum == expected);
  }
}

TEST(Product, OfTransposesAndBlocksIsThatOfTheirCopies) {
  Random random(2);
  const Eigen::MatrixXd a = random_matrix(random, 40, 21), b = random_matrix(random, 37, 30);
  const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> by_rows = a;
  const Eigen::MatrixXd copy = a.block(3, 2, 20, 18).transpose(), right = b.topRows(20);
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(18, 30);
  add_by_definition(1.0, copy, right, expected);
  EXPECT_TRUE(product(a.block(3, 2, 20, 18).transpose(), b.topRows(20)) == expected);
  EXPECT_TRUE(product(by_rows.block(3, 2, 20, 18).transpose(), b.topRows(20)) == expected);
}

TEST(Product, AddsToABlockAndLeavesTheRest) {
  Random random(3);
  const Eigen::MatrixXd a = random_matrix(random, 20, 6), before = random_matrix(random, 50, 40);
  Eigen::MatrixXd sum = before;
  add_square(2.0, a, sum.block(10, 5, 20, 20));
  Eigen::MatrixXd square = before.block(10, 5, 20, 20);
  add_by_definition(2.0, a, a.transpose(), square);
  for (Eigen::Index c = 0; c < sum.cols(); ++c)
    for (Eigen::Index r = 0; r < sum.rows(); ++r) {
      const bool added = r >= 10 && r < 30 && c >= 5 && c < 25 && r - 10 >= c - 5;
      EXPECT_EQ(sum(r, c), added ? square(r - 10, c - 5) : before(r, c)) << r << ' ' << c;
    }
}

TEST(Product, HasTheSameBitsForEveryWidthOfVectors) {
  Random random(4);
  const Eigen::Index depth = 37;
  const Eigen::MatrixXd left = random_matrix(random, kTileRows, depth),
                        right = random_matrix(random, kTileColumns, depth);
  const Eigen::MatrixXd before = random_matrix(random, kTileRows, kTileColumns);
  Eigen::MatrixXd expected = before;
  add_by_definition(-0.7, left, right.transpose(), expected);
  for (const TileSum sum : tile_sums()) {
    Eigen::MatrixXd tile = before;
    sum(depth, left.data(), right.data(), -0.7, tile.data(), kTileRows);
    EXPECT_TRUE(tile == expected);
  }
}

TEST(Product, CarriesWhatIsNotFinite) {
  Eigen::MatrixXd a = Eigen::MatrixXd::Ones(5, 5);
  a(2, 3) = std::numeric_limits<double>::infinity();
  a(4, 0) = std::numeric_limits<double>::quiet_NaN();
  const Eigen::MatrixXd square = product(a, a.transpose());
  EXPECT_EQ(square(2, 0), std::numeric_limits<double>::infinity());
  EXPECT_TRUE(std::isnan(square(4, 1)));
  EXPECT_EQ(square(0, 1), 5.0);
}

TEST(CholeskyFactor, OfAnySizeMultipliesBackAndSolves) {
  Random random(5);
  for (const Eigen::Index n : {1, 5, 24, 25, 60, 131}) {
    SCOPED_TRACE(n);
    const Eigen::MatrixXd root = random_matrix(random, n, n + 3);
    const Eigen::MatrixXd a = root * root.transpose();
    const Cholesky factor(a);
    ASSERT_TRUE(factor.positive());
    EXPECT_LT((factor.lower() * factor.lower().transpose() - a).norm(), 1e-13 * a.norm());
    const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(n, n);
    EXPECT_LT((factor.lower_inverse() * factor.lower() - one).norm(), 1e-9);
    EXPECT_LT((factor.inverse() * a - one).norm(), 1e-6);
    const Eigen::MatrixXd b = random_matrix(random, n, 3);
    EXPECT_LT((a * factor.solve(b) - b).norm(), 1e-6);
    EXPECT_LT((a * factor.solve(Eigen::VectorXd(b.col(1))) - b.col(1)).norm(), 1e-6);
    EXPECT_NEAR(factor.log_det(), 2.0 * a.llt().matrixLLT().diagonal().array().log().sum(), 1e-9);
  }
}

TEST(CholeskyFactor, IsNotPositiveWhereAnyPivotIsNot) {
  for (const Eigen::Index bad : {0, 23, 24, 40, 59}) {
    Eigen::MatrixXd a = Eigen::MatrixXd::Identity(60, 60);
    a(bad, bad) = -1e-3;
    EXPECT_FALSE(Cholesky(a).positive()) << bad;
    a(bad, bad) = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(Cholesky(a).positive()) << bad;
  }
  EXPECT_TRUE(Cholesky(Eigen::MatrixXd(0, 0)).positive());
}

}  // namespace
}  // namespace cellcal::calib
