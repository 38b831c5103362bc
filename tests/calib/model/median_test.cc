#include <gtest/gtest.h>

#include <cmath>

#include "calib/model/linear.h"

namespace cellcal::calib {
namespace {

TEST(MedianOfValues, IsTheMiddleOneInAnyOrder) {
  EXPECT_EQ(median({3.0, 1.0, 2.0}), 2.0);
  EXPECT_EQ(median({7.0}), 7.0);
}

TEST(MedianOfValues, OfAnEvenNumberIsTheUpperOfTheTwo) {
  EXPECT_EQ(median({4.0, 1.0, 3.0, 2.0}), 3.0);
}

TEST(MedianOfValues, OfTablesLiesBetweenTheTwo) {
  EXPECT_EQ(median_between({4.0, 1.0, 3.0, 2.0}), 2.5);
  EXPECT_EQ(median_between({9.0, 1.0, 3.0}), 3.0);
  EXPECT_TRUE(std::isnan(median_between({})));
}

}  // namespace
}  // namespace cellcal::calib
