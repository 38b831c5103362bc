// Readings of a touch that count, and the resulting values.

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "daemon/session/interruption.h"

namespace cellcal::daemon {
namespace {

Reading reading_at(double along_m, const char* utc = "") {
  Reading reading;
  reading.along_m = along_m;
  reading.contact_rad = {along_m, 2 * along_m};
  reading.settled_rad = {along_m + 0.1, along_m + 0.2};
  reading.utc = utc;
  return reading;
}

TouchPolicy policy_of(int readings, double tolerance_m = 60e-6) {
  TouchPolicy policy;
  policy.readings = readings;
  policy.tolerance_m = tolerance_m;
  return policy;
}

TEST(SearchLine, TravelCountsFromTheStandoffAndMayLieBeyondEitherEnd) {
  calib::PlannedTouch planned;
  planned.standoff = {0.5, -0.2};
  planned.end = {0.8, -0.6};
  planned.search_m = 0.020;
  EXPECT_NEAR(travel_m(planned, {0.5, -0.2}), 0.0, 1e-15);
  EXPECT_NEAR(travel_m(planned, {0.8, -0.6}), 0.020, 1e-15);
  EXPECT_NEAR(travel_m(planned, {0.35, 0.0}), -0.010, 1e-15);
  EXPECT_NEAR(travel_m(planned, {0.95, -0.8}), 0.030, 1e-15);
  const drivers::AxisAngles middle = at_travel(planned, 0.010);
  ASSERT_EQ(middle.size(), 2u);
  EXPECT_NEAR(middle[0], 0.65, 1e-15);
  EXPECT_NEAR(middle[1], -0.4, 1e-15);
}

TEST(SearchLine, WithoutAWayThereIsNoTravel) {
  calib::PlannedTouch planned;
  planned.standoff = planned.end = {0.5};
  planned.search_m = 0.020;
  EXPECT_EQ(travel_m(planned, {0.7}), 0.0);
}

TEST(SearchLine, OfAControllerWithMoreOrFewerAxesCountsThoseThatBothHave) {
  calib::PlannedTouch planned;
  planned.standoff = {0.5, -0.2};
  planned.end = {0.8, -0.6};
  planned.search_m = 0.020;
  EXPECT_NEAR(travel_m(planned, {0.8, -0.6, 9.0}), 0.020, 1e-15)
      << "an external axis is not the plan's";
  EXPECT_NEAR(travel_m(planned, {0.65}), 0.010, 1e-15);
  Agreement agreement;
  agreement.readings = {reading_at(0.01), reading_at(0.02)};
  agreement.readings[1].contact_rad.push_back(7.0);
  EXPECT_EQ(touch_of(planned, agreement, 0.002).joint_rad.size(), 2u);
  std::swap(agreement.readings[0], agreement.readings[1]);
  EXPECT_EQ(touch_of(planned, agreement, 0.002).joint_rad.size(), 2u);
}

TEST(Agreement, IsFoundWhereOnlyTheMiddleTwoAgree) {
  const auto found = find_agreement(
      {reading_at(0.010), reading_at(0.020), reading_at(0.02001), reading_at(0.030)}, policy_of(2));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->readings[0].along_m, 0.020);
  EXPECT_NEAR(found->spread_m, 1e-5, 1e-12);
}

TEST(Agreement, OfNoneIsAskedOfNoTouch) {
  EXPECT_FALSE(find_agreement({reading_at(0.01)}, policy_of(0)));
  EXPECT_FALSE(find_agreement({}, policy_of(1)));
  EXPECT_TRUE(find_agreement({reading_at(0.01)}, policy_of(1)));
}

TEST(Agreement, FindsTheClosestWhereverTheyAre) {
  const std::vector<Reading> readings = {reading_at(0.0100), reading_at(0.01003),
                                         reading_at(0.0120), reading_at(0.01202),
                                         reading_at(0.0140), reading_at(0.01401)};
  const auto last = find_agreement(readings, policy_of(2));
  ASSERT_TRUE(last);
  EXPECT_EQ(last->readings.front().along_m, 0.0140);
  EXPECT_EQ(last->readings.back().along_m, 0.01401);
  EXPECT_NEAR(last->spread_m, 10e-6, 1e-12);
  // Among equals the first one.
  const auto first =
      find_agreement({reading_at(0.5), reading_at(0.75), reading_at(1.0)}, policy_of(2, 0.25));
  ASSERT_TRUE(first);
  EXPECT_EQ(first->readings.front().along_m, 0.5);
  EXPECT_EQ(first->spread_m, 0.25) << "the tolerance itself is within it";
}

TEST(Agreement, LeavesOutWhatIsNoNumberAndKeepsTheRest) {
  const auto found = find_agreement(
      {reading_at(NAN), reading_at(0.01), reading_at(HUGE_VAL), reading_at(0.01001)}, policy_of(2));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->readings.size(), 2u);
  EXPECT_FALSE(find_agreement({reading_at(NAN), reading_at(0.01)}, policy_of(2)));
}

TEST(Agreement, OfFourGivesTheMeanOfTheTwoInTheMiddleAndTheLatestTime) {
  const auto found = find_agreement(
      {reading_at(0.01003, "2026-01-01T00:00:40Z"), reading_at(0.01, "2026-01-01T00:00:10Z"),
       reading_at(0.01001, "2026-01-01T00:00:50Z"), reading_at(0.01002, "2026-01-01T00:00:20Z")},
      policy_of(4));
  ASSERT_TRUE(found);
  const calib::Touch touch = touch_of({}, *found, 0.002);
  ASSERT_EQ(touch.joint_rad.size(), 2u);
  EXPECT_DOUBLE_EQ(touch.joint_rad[0], 0.010015);
  EXPECT_DOUBLE_EQ(touch.joint_rad[1], 0.02003);
  EXPECT_DOUBLE_EQ(touch.settled_joint_rad[0], 0.110015);
  EXPECT_DOUBLE_EQ(touch.settled_joint_rad[1], 0.210015);
  EXPECT_EQ(touch.readings, 4);
  EXPECT_NEAR(touch.spread_m, 30e-6, 1e-12);
  EXPECT_EQ(touch.time, "2026-01-01T00:00:50Z");
}

}  // namespace
}  // namespace cellcal::daemon
