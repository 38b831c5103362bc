#include <gtest/gtest.h>

#include "daemon/files/log_context.h"

namespace cellcal::daemon {
namespace {

using namespace std::chrono_literals;

TEST(Seldom, LetsTheFirstThroughAndThenOneAMinuteWithHowManyItStandsFor) {
  OccurrenceLimit seldom;
  const std::chrono::steady_clock::time_point begun{1h};
  EXPECT_EQ(seldom.count(begun), 1u);
  for (int i = 1; i < 60; ++i) EXPECT_FALSE(seldom.count(begun + i * 1s));
  EXPECT_EQ(seldom.count(begun + 60s), 60u);
  EXPECT_FALSE(seldom.count(begun + 61s));
  EXPECT_EQ(seldom.count(begun + 1h), 2u);
}

}  // namespace
}  // namespace cellcal::daemon
