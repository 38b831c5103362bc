#include <gtest/gtest.h>

#include "daemon/unattended/decision.h"
#include "tests/daemon/unattended/zone.h"

namespace cellcal::daemon {
namespace {

using testing::kBerlin;
using testing::kHour;
using testing::Zone;
using namespace std::chrono_literals;

WeeklyWindow daily(int from_min, int to_min) {
  WeeklyWindow weekly;
  weekly.from_min = from_min;
  weekly.to_min = to_min;
  return weekly;
}

Window on(const WeeklyWindow& weekly, std::chrono::year_month_day day) {
  return window_on(weekly, std::chrono::sys_days(day));
}

double hours(const Window& window) {
  return static_cast<double>(window.ends - window.begins) / kHour;
}

TEST(AWindow, EndsOnTheNextDayWhereItsEndIsTheEarlierTimeOfDay) {
  const Zone zone(kBerlin);
  const Window window = on(daily(22 * 60, 5 * 60), 2026y / 11 / 22);
  EXPECT_EQ(local_time(window.begins), "2026-11-22 22:00");
  EXPECT_EQ(local_time(window.ends), "2026-11-23 05:00");
  EXPECT_EQ(to_string(window.day), "2026-11-22");
  EXPECT_TRUE(window.has(window.begins) && !window.has(window.ends));
  EXPECT_DOUBLE_EQ(hours(on(daily(60, 120), 2026y / 11 / 22)), 1.0);
}

TEST(AWindow, OfANightInWhichClocksAreSetIsShorterOrLongerByAnHour) {
  const Zone zone(kBerlin);
  EXPECT_DOUBLE_EQ(hours(on(daily(22 * 60, 5 * 60), 2026y / 3 / 28)), 6.0);
  EXPECT_DOUBLE_EQ(hours(on(daily(22 * 60, 5 * 60), 2026y / 10 / 24)), 8.0);
}

TEST(AWindow, ThatLiesInTheHourThatIsLeftOutDoesNotExistThatNight) {
  const Zone zone(kBerlin);
  const Window none = on(daily(130, 170), 2026y / 3 / 29);
  EXPECT_FALSE(none.exists());
  EXPECT_EQ(local_time(none.begins), "2026-03-29 03:00");
  EXPECT_TRUE(on(daily(130, 170), 2026y / 3 / 28).exists());
  EXPECT_EQ(local_time(on(daily(150, 300), 2026y / 3 / 29).begins), "2026-03-29 03:00");
  EXPECT_EQ(on(daily(60, 150), 2026y / 3 / 29).ends, none.begins);
}

TEST(AWindow, WhoseHourComesTwiceIsThereOnce) {
  const Zone zone(kBerlin);
  EXPECT_NEAR(hours(on(daily(130, 170), 2026y / 10 / 25)), 40.0 / 60.0, 1e-9);
  const Window early = on(daily(60, 150), 2026y / 10 / 25),
               late = on(daily(150, 300), 2026y / 10 / 25);
  EXPECT_DOUBLE_EQ(hours(early), 1.5);
  EXPECT_DOUBLE_EQ(hours(late), 2.5);
  EXPECT_EQ(late.begins - early.ends, kHour) << "the first 02:30 ends it, the second begins it";
}

/// Persons who follow the local time are never in the cell within a window.
TEST(EveryMomentOfAWindow, LiesInsideItByTheClockOnTheWall) {
  for (const char* name :
       {kBerlin, "UTC0", "EST5EDT,M3.2.0,M11.1.0", "<+1030>-10:30<+11>-11,M10.1.0,M4.1.0",
        "<-03>3<-02>,M3.5.0/-1,M10.5.0/0"}) {
    const Zone zone(name);
    for (const WeeklyWindow& weekly :
         {daily(130, 170), daily(60, 150), daily(150, 300), daily(22 * 60, 5 * 60),
          daily(23 * 60 + 30, 30), daily(110, 100)}) {
      for (auto day = std::chrono::sys_days(2026y / 1 / 1);
           day < std::chrono::sys_days(2027y / 1 / 1); day += std::chrono::days(1)) {
        const Window window = window_on(weekly, day);
        for (UtcSeconds at = window.begins; at < window.ends; at += 600) {
          const std::time_t time = at;
          std::tm wall{};
          ::localtime_r(&time, &wall);
          const int minute = wall.tm_hour * 60 + wall.tm_min;
          const bool inside = weekly.from_min < weekly.to_min
                                  ? weekly.from_min <= minute && minute < weekly.to_min
                                  : weekly.from_min <= minute || minute < weekly.to_min;
          ASSERT_TRUE(inside) << name << ' ' << local_time(at);
        }
      }
    }
  }
}

TEST(TheNextNight, IsOnADayOnWhichTheWindowBegins) {
  const Zone zone(kBerlin);
  WeeklyWindow weekly = daily(22 * 60, 5 * 60);
  weekly.days = {false, false, false, true, false, false, false};  // Wednesday
  const UtcSeconds sunday = on(daily(12 * 60, 13 * 60), 2026y / 11 / 22).begins;
  EXPECT_EQ(local_time(next_window(weekly, sunday).begins), "2026-11-25 22:00");
  const UtcSeconds then = next_window(weekly, sunday).begins;
  EXPECT_EQ(local_time(next_window(weekly, then).begins), "2026-12-02 22:00");
}

TEST(TheNights, BetweenTwoMomentsAreAllOfThoseThatEndBehindTheFirst) {
  const Zone zone(kBerlin);
  const WeeklyWindow weekly = daily(22 * 60, 5 * 60);
  const UtcSeconds noon = on(daily(12 * 60, 13 * 60), 2026y / 11 / 22).begins;
  EXPECT_EQ(windows_between(weekly, noon, noon).size(), 0u);
  EXPECT_EQ(windows_between(weekly, noon, noon + 10 * kHour).size(), 1u);
  EXPECT_EQ(windows_between(weekly, noon, noon + 5 * 24 * kHour).size(), 5u);
  EXPECT_EQ(windows_between(weekly, noon + 11 * kHour, noon + 11 * kHour).size(), 1u) << "it lasts";
  EXPECT_EQ(windows_between(weekly, noon - 7 * kHour, noon).size(), 0u) << "its end is not of it";
}

}  // namespace
}  // namespace cellcal::daemon
