// The remaining time of a session, from the pace of its touches.

#include <gtest/gtest.h>

#include "daemon/service/job.h"

namespace cellcal::daemon {
namespace {

TEST(TheTimeLeft, IsKnownAfterATouchAndStaysWhileALinkIsAwaited) {
  TimeLeft left;
  const drivers::TimePoint begun{};
  const auto after = [&](int seconds) { return begun + std::chrono::seconds(seconds); };
  EXPECT_FALSE(left.update(Phase::kTransit, 0, 10, begun));
  EXPECT_FALSE(left.update(Phase::kRecovering, 0, 10, after(5)));
  EXPECT_EQ(left.update(Phase::kRetreat, 1, 10, after(20)), 180.0);
  EXPECT_EQ(left.update(Phase::kTransit, 1, 10, after(25)), 175.0);
  for (const Phase phase : {Phase::kRecovering, Phase::kWatchingTheLinks})
    EXPECT_EQ(left.update(phase, 1, 10, after(300)), 175.0);
  EXPECT_FALSE(left.update(Phase::kIdentifying, 10, 10, after(400)));
}

}  // namespace
}  // namespace cellcal::daemon
