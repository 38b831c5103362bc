// Touches chosen jointly are better than greedy ones, and all are feasible.

#include <gtest/gtest.h>

#include <cstdio>
#include <set>

#include "calib/model/linear.h"
#include "calib/plan/choose.h"
#include "tests/calib/plan/random_rows.h"

namespace cellcal::calib {
namespace {

using testing::random_rows;

Design some_design(std::uint64_t seed, Eigen::Index candidates = 40) {
  constexpr Eigen::Index kUnknowns = 12;
  Random random(seed);
  RowMajor rows = random_rows(candidates, kUnknowns, random);
  const Eigen::MatrixXd moves = random_rows(60, 9, random);
  return {std::move(rows), Eigen::MatrixXd::Identity(kUnknowns, kUnknowns), moves};
}

bool any(std::size_t) { return true; }

/// Reduction of the sum of position variances by these.
double taken(Design design, const std::vector<std::size_t>& picked) {
  double sum = 0.0;
  for (const std::size_t c : picked) {
    sum += design.gain(static_cast<Eigen::Index>(c));
    design.take(static_cast<Eigen::Index>(c));
  }
  return sum;
}

std::vector<std::size_t> one_after_the_other(Design design, int count) {
  std::vector<std::size_t> picked;
  for (int k = 0; k < count; ++k) {
    Eigen::Index best = -1;
    for (Eigen::Index c = 0; c < design.size(); ++c)
      if (!design.has(c) && (best < 0 || design.gain(c) > design.gain(best))) best = c;
    design.take(best);
    picked.push_back(static_cast<std::size_t>(best));
  }
  return picked;
}

TEST(ChooseTogether, IsNeverWorseThanOneAfterTheOtherAndOftenBetter) {
  int better = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const Design design = some_design(seed);
    const auto together = choose_together(design, 8, any);
    ASSERT_EQ(together.size(), 8U);
    const double greedy = taken(design, one_after_the_other(design, 8));
    const double exchanged = taken(design, together);
    EXPECT_GE(exchanged, greedy * (1.0 - 1e-9)) << seed;
    if (exchanged > greedy * 1.0001) ++better;
  }
  std::printf("better than one after the other in %d of 30\n", better);
  EXPECT_GT(better, 10);
}

TEST(ChooseTogether, PicksOnlyWhatIsPossibleAndNothingTwice) {
  std::set<std::size_t> refused;
  const auto even = [&](std::size_t c) {
    EXPECT_FALSE(refused.contains(c)) << "asked again";
    if (c % 2 == 0) return true;
    refused.insert(c);
    return false;
  };
  const auto picked = choose_together(some_design(3), 10, even);
  EXPECT_EQ(picked.size(), 10U);
  EXPECT_EQ(std::set<std::size_t>(picked.begin(), picked.end()).size(), 10U);
  for (const std::size_t c : picked) EXPECT_EQ(c % 2, 0U);
}

TEST(ChooseTogether, OfMoreThanThereIsTakesWhatThereIs) {
  EXPECT_EQ(choose_together(some_design(4, 6), 10, any).size(), 6U);
  EXPECT_TRUE(choose_together(some_design(4, 0), 10, any).empty());
  EXPECT_TRUE(choose_together(some_design(4), 10, [](std::size_t) { return false; }).empty());
  EXPECT_TRUE(choose_together(some_design(4), 0, any).empty());
}

TEST(ChooseTogether, LeavesOutWhatTheDesignHas) {
  Design design = some_design(5);
  for (const std::size_t c : choose_together(design, 5, any))
    design.take(static_cast<Eigen::Index>(c));
  for (const std::size_t c : choose_together(design, 5, any))
    EXPECT_FALSE(design.has(static_cast<Eigen::Index>(c)));
}

}  // namespace
}  // namespace cellcal::calib
