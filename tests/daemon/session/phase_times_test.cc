// Durations of each activity, from the changes of phase.

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "daemon/session/phase.h"

namespace cellcal::daemon {
namespace {

constexpr double kMs = 1e-3;

TimedChange at(int ms, Phase from, Phase to) { return {kMs * ms, {from, to}}; }

TEST(TheTimesOfASession, CountWhatInterruptedItAndNoWaitTwice) {
  using enum Phase;
  const PhaseTimes times = phase_times(std::vector<TimedChange>{
      at(0, kTransit, kArmingFast), at(10, kArmingFast, kFastSearch),
      at(50, kFastSearch, kRecovering), at(60, kRecovering, kWatchingTheLinks),
      at(2060, kWatchingTheLinks, kRecovering), at(2070, kRecovering, kWatchingTheLinks),
      at(4070, kWatchingTheLinks, kReferencing), at(4100, kReferencing, kRouting),
      at(4200, kRouting, kTransit), at(5200, kTransit, kRecovering)});
  EXPECT_EQ(times.interruptions, 2);
}

TEST(TheTimesOfASession, AreToldByWhatItDid) {
  using enum Phase;
  const PhaseTimes times = phase_times(std::vector<TimedChange>{
      at(0, kIdle, kPlanning), at(100, kPlanning, kConnecting), at(400, kConnecting, kTransit),
      at(1400, kTransit, kArmingFast), at(1410, kArmingFast, kFastSearch),
      at(1910, kFastSearch, kBackingOff), at(2110, kBackingOff, kArmingSlow),
      at(2120, kArmingSlow, kSlowSearch), at(2720, kSlowSearch, kRecording),
      at(2725, kRecording, kRetreat), at(3225, kRetreat, kTransit), at(4725, kTransit, kArmingFast),
      at(4730, kArmingFast, kFastSearch), at(5030, kFastSearch, kRecording),
      at(5035, kRecording, kRetreat), at(6035, kRetreat, kIdentifying),
      at(6135, kIdentifying, kDone)});
  EXPECT_EQ(times.touches, 2);
  EXPECT_NEAR(times.total_s, 6.135, kMs);
  const ActivityTime& moving = times[Activity::kMoving];
  EXPECT_EQ(moving.count, 3);  // the retreat continues as the transit
  EXPECT_NEAR(moving.total_s, 4.0, kMs);
  EXPECT_NEAR(moving.worst_s, 2.0, kMs);
  EXPECT_EQ(times[Activity::kFastSearch].count, 2);
  EXPECT_NEAR(times[Activity::kFastSearch].worst_s, 0.5, kMs);
  EXPECT_EQ(times[Activity::kConfirming].count, 2);
  EXPECT_NEAR(times[Activity::kConfirming].total_s, 0.8, kMs);
  EXPECT_EQ(times[Activity::kArming].count, 3);
  EXPECT_NEAR(times[Activity::kRecording].total_s, 0.01, kMs);
  EXPECT_EQ(times[Activity::kChoosing].count, 0);
  EXPECT_NEAR(times[Activity::kOther].total_s, 0.5, kMs);
}

TEST(TheTimesOfASession, LeaveOutWhatLiesBetweenItsEndAndItsResuming) {
  using enum Phase;
  const PhaseTimes failed = phase_times(
      std::vector<TimedChange>{at(0, kIdle, kPlanning), at(1000, kPlanning, kFailed),
                               at(31000, kIdle, kPlanning), at(32000, kPlanning, kConnecting)});
  EXPECT_NEAR(failed.total_s, 2.0, kMs);
  // A killed daemon recorded no end.
  const PhaseTimes killed = phase_times(
      std::vector<TimedChange>{at(0, kPlanning, kTransit), at(500, kTransit, kFastSearch),
                               at(31000, kIdle, kPlanning), at(32000, kPlanning, kConnecting)});
  EXPECT_NEAR(killed.total_s, 1.5, kMs);
  EXPECT_EQ(killed[Activity::kFastSearch].count, 0);
}

TEST(TheTimesOfASession, AreZeroWithoutChangesOrWithTimesThatAreNone) {
  using enum Phase;
  EXPECT_EQ(phase_times({}).total_s, 0.0);
  const double none = std::numeric_limits<double>::infinity();
  const PhaseTimes times = phase_times(std::vector<TimedChange>{at(0, kPlanning, kTransit),
                                                                {none, {kTransit, kFastSearch}},
                                                                {-none, {kFastSearch, kRetreat}}});
  EXPECT_EQ(times.total_s, 0.0);
  // Setting the clock back does not subtract time.
  const PhaseTimes back = phase_times(std::vector<TimedChange>{
      at(5000, Phase::kRetreat, Phase::kTransit), at(1000, Phase::kTransit, Phase::kArmingFast)});
  EXPECT_EQ(back.total_s, 0.0);
}

TEST(TheTimesOfASession, NameEveryActivityAndWhatItHangsOn) {
  for (const Activity one : kAllActivities) {
    EXPECT_FALSE(std::string(to_string(one)).empty());
    EXPECT_FALSE(std::string(driver_of(one)).empty());
  }
  for (const Phase phase : kAllPhases)
    EXPECT_NE(std::find(kAllActivities.begin(), kAllActivities.end(), activity_of(phase)),
              kAllActivities.end());
}

}  // namespace
}  // namespace cellcal::daemon
