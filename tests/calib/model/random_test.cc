// Numbers that must be identical on every platform.

#include <gtest/gtest.h>

#include <set>

#include "calib/model/linear.h"

namespace cellcal::calib {
namespace {

TEST(Random, IsTheStandardsGeneratorUnderDistributionsOfItsOwn) {
  // [rand.predef]: the 10000th number of mt19937_64 from its default seed.
  Random random(5489u);
  double last = 0.0;
  for (int i = 0; i < 10000; ++i) last = random.uniform();
  EXPECT_EQ(last, static_cast<double>(9981545732273789042u >> 11) * 0x1.0p-53);
}

TEST(Random, GivesTheSameSequenceForTheSameSeedAndAnotherForAnother) {
  Random a(7), b(7), c(8);
  bool differs = false;
  for (int i = 0; i < 100; ++i) {
    const double x = a.normal();
    EXPECT_EQ(x, b.normal());
    differs = differs || x != c.normal();
  }
  EXPECT_TRUE(differs);
}

TEST(Random, StaysInsideItsBounds) {
  Random random(1);
  std::set<std::size_t> seen;
  for (int i = 0; i < 100000; ++i) {
    const double u = random.uniform(-2.0, 3.0);
    ASSERT_GE(u, -2.0);
    ASSERT_LT(u, 3.0);
    ASSERT_TRUE(std::isfinite(random.normal()));
    seen.insert(random.below(7));
  }
  EXPECT_EQ(seen, (std::set<std::size_t>{0, 1, 2, 3, 4, 5, 6}));
}

TEST(Random, NormalHasMeanZeroVarianceOneAndGaussianTails) {
  Random random(2);
  constexpr int kCount = 200000;  // standard error of the mean 0.0022, of the variance 0.0032
  double sum = 0.0, squares = 0.0;
  int beyond = 0;
  for (int i = 0; i < kCount; ++i) {
    const double x = random.normal();
    sum += x;
    squares += x * x;
    beyond += std::abs(x) > 3.0;
  }
  EXPECT_NEAR(sum / kCount, 0.0, 0.011);
  EXPECT_NEAR(squares / kCount, 1.0, 0.016);
  EXPECT_NEAR(static_cast<double>(beyond) / kCount, 0.0027, 0.0006);
}

}  // namespace
}  // namespace cellcal::calib
