#include <gtest/gtest.h>

#include <cmath>

#include "calib/model/linear.h"

namespace cellcal::calib {
namespace {

TEST(MedianOfValues, is_the_middle_one_in_any_order) {
  EXPECT_EQ(median({3.0, 1.0, 2.0}), 2.0);
  EXPECT_EQ(median({7.0}), 7.0);
}

TEST(MedianOfValues, of_an_even_number_is_the_upper_of_the_two) {
  EXPECT_EQ(median({4.0, 1.0, 3.0, 2.0}), 3.0);
}

TEST(MedianOfValues, of_tables_lies_between_the_two) {
  EXPECT_EQ(median_between({4.0, 1.0, 3.0, 2.0}), 2.5);
  EXPECT_EQ(median_between({9.0, 1.0, 3.0}), 3.0);
  EXPECT_TRUE(std::isnan(median_between({})));
}

}  // namespace
}  // namespace cellcal::calib
