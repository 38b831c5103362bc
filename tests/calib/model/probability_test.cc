#include <gtest/gtest.h>

#include <vector>

#include "calib/model/linear.h"

namespace cellcal::calib {
namespace {

TEST(NormalNumbers, AreAboveTheirQuantilesAsTheTablesHaveIt) {
  EXPECT_EQ(normal_above(0.0), 0.5);
  EXPECT_NEAR(normal_above(1.6448536269514722), 0.05, 1e-15);
  EXPECT_NEAR(normal_above(-1.0), 0.8413447460685429, 1e-15);
}

TEST(SumOfLogarithms, IsThatOfWhatNoNumberHolds) {
  EXPECT_NEAR(log_sum(std::vector<double>{std::log(0.25), std::log(0.5)}), std::log(0.75), 1e-15);
  EXPECT_NEAR(log_sum(std::vector<double>{-5000.0, -5000.0}), -5000.0 + std::log(2.0), 1e-9);
  EXPECT_EQ(log_sum(std::vector<double>{3.0}), 3.0);
  EXPECT_EQ(log_sum({}), -std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace cellcal::calib
